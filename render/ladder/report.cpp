// The ladder's table as text, JSON and a page.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "render/base/html.h"
#include "render/ladder/ladder.h"

namespace carpool::render {
namespace {

template <class... Args>
std::string Format(const char* format, Args... args) {
  char line[256];
  std::snprintf(line, sizeof line, format, args...);
  return line;
}

std::string Image(const RungResult& r) {
  if (r.identical) return "same bytes";
  return Format("%+.2f %%, p = %.2g", 100 * r.difference, r.p_value);
}

std::string Scheduler(const RungResult& r) {
  return r.scheduler < 0 ? "-" : Format("%.2f %%", 100 * r.scheduler);
}

std::string Title(const LadderReport& report) {
  return report.scene +
         Format(": %dx%d, %d samples, ", report.width, report.height, report.samples) +
         Format("%d threads, %s, medians of %d", report.threads, report.isa.c_str(), report.rounds);
}

}  // namespace

std::string LadderReport::Text() const {
  std::string text = Title(*this) + "\n";
  text += Format("%-40s %8s %8s %6s %6s %7s %8s %9s %9s  %s\n", "rung", "s", "M rays/s", "speed",
                 "seats", "run", "bubbles", "state MiB", "scheduler", "image");
  for (const RungResult& r : rungs) {
    const std::string name = std::to_string(r.number) + " " + r.name;
    if (!r.ran) {
      text += Format("%-40s ", name.c_str()) + (r.note.empty() ? "stopped" : r.note) + "\n";
      continue;
    }
    text += Format("%-40s %8.2f %8.2f %5.2fx %4.0f %% %7.0f %6.1f %% %9.2f %9s  ", name.c_str(),
                   r.seconds, r.mega_rays, r.speed, 100 * r.seats_filled, r.run_length,
                   100 * r.bubbles, r.state_mebibytes, Scheduler(r).c_str()) +
            Image(r) + "\n";
  }
  return text;
}

std::string LadderReport::Json() const {
  nlohmann::ordered_json json = {{"scene", scene},     {"width", width},     {"height", height},
                                 {"samples", samples}, {"threads", threads}, {"isa", isa},
                                 {"rounds", rounds},   {"stopped", stopped}};
  auto& list = json["rungs"] = nlohmann::ordered_json::array();
  for (const RungResult& r : rungs) {
    nlohmann::ordered_json row = {{"rung", r.number}, {"name", r.name}, {"ran", r.ran}};
    if (!r.note.empty()) row["note"] = r.note;
    if (r.ran) {
      row.update({{"seconds", r.seconds},
                  {"mega_rays_per_second", r.mega_rays},
                  {"speed_over_rung_3", r.speed},
                  {"seats_filled", r.seats_filled},
                  {"run_length", r.run_length},
                  {"bubbles", r.bubbles},
                  {"state_mebibytes", r.state_mebibytes},
                  {"identical", r.identical},
                  {"difference", r.difference},
                  {"p_value", r.p_value}});
      if (r.scheduler >= 0) row["scheduler_share"] = r.scheduler;
    }
    list.push_back(row);
  }
  return json.dump(1) + "\n";
}

std::string LadderReport::Html() const {
  double most = 0;
  for (const RungResult& r : rungs) most = std::max(most, r.speed);
  std::string page =
      "<!doctype html>\n<meta charset=\"utf-8\">\n<title>The ladder</title>\n<style>\n"
      "body{font:15px sans-serif;margin:2em auto;max-width:70em}\n"
      "table{border-collapse:collapse}td,th{padding:.3em .7em;text-align:right}\n"
      "td:first-child,th:first-child{text-align:left}tr{border-bottom:1px solid #ddd}\n"
      ".bar{background:#3572b0;height:1.1em;display:inline-block;vertical-align:middle}\n"
      "td.chart{text-align:left;min-width:22em}\n</style>\n<h1>The ladder</h1>\n<p>" +
      Escape(Title(*this)) + "</p>\n<table>\n<tr><th>rung<th>speed over rung 3<th>s<th>M rays/s" +
      "<th>seats filled<th>run length<th>bubbles<th>state, MiB<th>scheduler<th>image\n";
  for (const RungResult& r : rungs) {
    page += "<tr><td>" + std::to_string(r.number) + " " + Escape(r.name);
    if (!r.ran) {
      page += "<td class=\"chart\" colspan=\"9\">" +
              Escape(r.note.empty() ? std::string("stopped") : r.note) + "\n";
      continue;
    }
    page += Format("<td class=\"chart\"><span class=\"bar\" style=\"width:%.2fem\"></span> %.2fx",
                   most > 0 ? 18 * r.speed / most : 0, r.speed);
    page +=
        Format("<td>%.2f<td>%.2f<td>%.0f %%<td>%.0f<td>%.1f %%<td>%.2f<td>", r.seconds, r.mega_rays,
               100 * r.seats_filled, r.run_length, 100 * r.bubbles, r.state_mebibytes);
    page += Scheduler(r) + "<td>" + Image(r) + "\n";
  }
  return page + "</table>\n";
}

}  // namespace carpool::render
