// Writes the benchmark page: bars over all scenes, the rows, then each scene's stages and ladder.
#include "tools/bench/page.h"

#include <algorithm>
#include <cstdio>

#include "render/base/html.h"

namespace carpool::tools {
namespace {

using render::Escape;

constexpr char kHead[] = R"(<!doctype html>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>Carpool: how fast</title>
<style>
body{font:15px/1.45 sans-serif;margin:2em auto;max-width:68em;padding:0 1em;color:#222}
h2{margin-top:2.2em}
table{border-collapse:collapse;margin:1em 0}
td,th{padding:.25em .7em;text-align:right;border-bottom:1px solid #ddd}
td:first-child,th:first-child{text-align:left}
td.chart{text-align:left;min-width:20em}
.bar{background:#3572b0;height:1em;display:inline-block;vertical-align:middle}
.bar.mega{background:#b0a08a}.bar.lost{background:#c0392b}
.missed{color:#c0392b;font-weight:bold}
</style>
<h1>How fast</h1>
)";

template <class... Args>
std::string Format(const char* format, Args... args) {
  char text[512];
  std::snprintf(text, sizeof text, format, args...);
  return text;
}

std::string Bar(double value, double most, const char* kind) {
  return Format("<span class=\"bar %s\" style=\"width:%.2fem\"></span>", kind,
                most > 0 ? 16 * value / most : 0);
}

std::string SpeedChart(const std::vector<SceneFigures>& scenes) {
  std::string out =
      "<h2>Of what bare Embree does with the same rays</h2>\n<p>Embree replays all rays of the "
      "render and nothing else, in the fastest of four ways: one by one or in packets, as they "
      "came or sorted (sorting counted). Blue: the wavefront, red where it loses to the "
      "megakernel. Grey: the megakernel, "
      "from the same kernels at one lane.\n<table>\n<tr><th>scene<th>share of Embree"
      "<th>wavefront<th>megakernel<th>wavefront / single rays<th>wavefront / megakernel"
      "<th>least..most\n";
  for (const SceneFigures& f : scenes) {
    const bool lost = f.over_mega < 1;
    out += "<tr><td>" + Escape(f.scene.label) + "<td class=\"chart\">" +
           Bar(f.over_embree, 1, lost ? "lost" : "wave") + "<br>" +
           Bar(f.mega_over_embree, 1, "mega");
    out += Format("<td>%.2f<td>%.2f<td>%.2f<td%s>%.2fx<td>%.2f..%.2f\n", f.over_embree,
                  f.mega_over_embree, f.over_singles, lost ? " class=\"missed\"" : "", f.over_mega,
                  f.least_over_mega, f.most_over_mega);
  }
  return out + "</table>\n";
}

/// `title` is what all names begin with and the reader knows already.
std::string RowTable(const std::vector<Row>& rows, const std::string& title) {
  std::string out = "<table>\n<tr><th>figure<th>value<th>target\n";
  for (const Row& row : rows) {
    const size_t known = row.name.starts_with(title) ? title.size() : 0;
    out += "<tr><td>" + Escape(row.name.substr(known));
    out += Format("<td%s>%.3g %s<td>%s\n", row.holds ? "" : " class=\"missed\"", row.value,
                  row.unit.c_str(), Escape(row.target).c_str());
  }
  return out + "</table>\n";
}

std::string StageTable(const RunReport& report) {
  std::string out =
      "<table>\n<tr><th>stage<th>items<th>batches<th>items per batch<th>seats filled<th>steals"
      "<th>ns per item<th>share of time\n";
  for (const StageReport& stage : report.stages) {
    const double items = static_cast<double>(std::max<uint64_t>(stage.items, 1));
    out += "<tr><td>" + Escape(stage.name);
    out += Format("<td>%llu<td>%llu<td>%.1f<td>%.1f %%<td>%llu<td>%.0f<td>%.1f %%\n",
                  static_cast<unsigned long long>(stage.items),
                  static_cast<unsigned long long>(stage.batches), stage.run_length,
                  100 * stage.seats_filled, static_cast<unsigned long long>(stage.steals),
                  1e9 * stage.kernel_seconds / items,
                  100 * stage.kernel_seconds / std::max(report.kernel_seconds, 1e-9));
  }
  return out + "</table>\n";
}

std::string LadderTable(const render::LadderReport& ladder) {
  double most = 0;
  for (const render::RungResult& r : ladder.rungs) most = std::max(most, r.speed);
  std::string out =
      Format("<p>The ladder, %dx%d, %d samples: speed over rung 3.\n", ladder.width, ladder.height,
             ladder.samples) +
      "<table>\n<tr><th>rung<th>speed<th>M rays/s<th>seats<th>bubbles<th>state, MiB<th>image\n";
  for (const render::RungResult& r : ladder.rungs) {
    out += Format("<tr><td>%d ", r.number) + Escape(r.name);
    if (!r.ran) {
      out += "<td class=\"chart\" colspan=\"6\">" + Escape(r.note) + "\n";
      continue;
    }
    out += "<td class=\"chart\">" + Bar(r.speed, most, r.speed < 1 ? "lost" : "wave");
    out +=
        Format(" %.2fx<td>%.2f<td>%.0f %%<td>%.1f %%<td>%.2f<td>%s\n", r.speed, r.mega_rays,
               100 * r.seats_filled, 100 * r.bubbles, r.state_mebibytes,
               r.identical ? "same bytes"
                           : Format("%+.2f %%, p = %.2g", 100 * r.difference, r.p_value).c_str());
  }
  return out + "</table>\n";
}

std::string SceneSection(const SceneFigures& f) {
  std::string out =
      "<h2>" + Escape(f.scene.label) + "</h2>\n" + RowTable(RowsOf(f), f.scene.label + ": ");
  out += Format(
      "<p>%d samples per pixel a round. Memory: %.1f MiB BVH, %.1f MiB film, %.2f MiB path state "
      "and queues. ",
      f.samples, f.bvh_mebibytes, f.film_mebibytes, f.mebibytes);
  out += "The wavefront's stages in the last round:\n" + StageTable(f.schedule);
  if (f.ladder) out += LadderTable(*f.ladder);
  return out;
}

}  // namespace

std::string Page(const BenchOptions& options, const std::vector<SceneFigures>& scenes,
                 const std::vector<std::string>& skipped) {
  std::string out = kHead;
  if (!scenes.empty()) {
    out += Format(
        "<p>%d threads, %s, %dx%d; medians of %d rounds, in each of which "
        "everything runs once, in turn. Only ratios mean much: the machine may be shared.\n",
        scenes.front().threads, scenes.front().isa.c_str(), options.width, options.height,
        options.rounds);
    out += SpeedChart(scenes) + RowTable(SummaryRows(scenes), "");
  }
  for (const std::string& line : skipped) out += "<p class=\"missed\">" + Escape(line) + "\n";
  for (const SceneFigures& f : scenes) out += SceneSection(f);
  return out;
}

}  // namespace carpool::tools
