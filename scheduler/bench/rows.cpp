// Writing figures.
#include "rows.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <utility>

namespace bench {

bool Rows::Row::holds() const {
  switch (bound) {
    case Bound::none:
      return true;
    case Bound::most:
      return value <= target;
    case Bound::least:
      return value >= target;
  }
  return false;
}

void Rows::Row::print() const {
  std::printf("%-66s %10.2f %-6s", name.c_str(), value, unit.c_str());
  if (bound != Bound::none) {
    std::printf(" %s%8.2f %s", bound == Bound::most ? "<=" : ">=", target,
                holds() ? "holds" : "MISSED");
  }
  std::printf("\n");
  std::fflush(stdout);
}

void Rows::add(Row row) {
  row.print();
  rows_.push_back(std::move(row));
}

void Rows::add(const std::string& name, double value, const char* unit) {
  add({name, value, unit, Bound::none, 0});
}

void Rows::at_most(const std::string& name, double value, const char* unit, double target) {
  add({name, value, unit, Bound::most, target});
}

void Rows::at_least(const std::string& name, double value, const char* unit, double target) {
  add({name, value, unit, Bound::least, target});
}

void Rows::bar(const std::string& group, const std::string& contestant, double nanoseconds) {
  bars_.push_back({group, contestant, nanoseconds});
}

bool Rows::write_json(const std::string& path) const {
  std::ofstream out(path);
  out << "[\n";
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Row& row = rows_[i];
    out << "  {\"name\": \"" << row.name << "\", \"value\": " << row.value << ", \"unit\": \""
        << row.unit << "\", \"target\": ";
    if (row.bound == Bound::none) {
      out << "null";
    } else {
      out << row.target;
    }
    out << ", \"holds\": " << (row.holds() ? "true" : "false")
        << (i + 1 < rows_.size() ? "},\n" : "}\n");
  }
  out << "]\n";
  return static_cast<bool>(out.flush());
}

bool Rows::write_plot(const std::string& path) const {
  constexpr int kLine = 18;
  constexpr int kLeft = 180;
  constexpr int kZero = 260;     // leaves room for bars that are faster than the loop
  constexpr double kScale = 3;   // pixels per nanosecond
  constexpr double kMost = 150;  // ns; longer bars are cut, their number tells
  std::string body;
  std::string group;
  int y = 40;
  char text[512];
  for (const Bar& bar : bars_) {
    if (bar.group != group) {
      group = bar.group;
      y += kLine;
      std::snprintf(text, sizeof text, "<text x='10' y='%d' font-weight='bold'>%s</text>\n", y,
                    group.c_str());
      body += text;
      y += 6;
    }
    const double length = kScale * std::min(kMost, std::abs(bar.nanoseconds));
    std::snprintf(
        text, sizeof text,
        "<text x='%d' y='%d' text-anchor='end'>%s</text><rect x='%.1f' y='%d' width='%.1f' "
        "height='12' fill='%s'/><text x='%.1f' y='%d'>%+.1f</text>\n",
        kLeft, y + 11, bar.contestant.c_str(), bar.nanoseconds < 0 ? kZero - length : kZero, y + 1,
        length, bar.contestant == "carpool" ? "#c0392b" : "#7f8c8d",
        (bar.nanoseconds < 0 ? kZero : kZero + length) + 5, y + 11, bar.nanoseconds);
    body += text;
    y += kLine;
  }
  std::ofstream out(path);
  out << "<svg xmlns='http://www.w3.org/2000/svg' width='800' height='" << y + 20
      << "' font-family='sans-serif' font-size='12'>\n<rect width='100%' height='100%' "
         "fill='white'/>\n<text x='10' y='24' font-size='15'>CPU nanoseconds per item-visit over "
         "the inlined loop (less is better)</text>\n"
      << body << "<line x1='" << kZero << "' x2='" << kZero << "' y1='40' y2='" << y
      << "' stroke='black'/>\n</svg>\n";
  return static_cast<bool>(out.flush());
}

}  // namespace bench
