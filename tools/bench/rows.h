// Figures of a benchmark: a table for people, and rows of JSON for scripts.
#pragma once

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace carpool::tools {

/// One figure; `target` is what it is held against, if anything.
struct Row {
  std::string name;
  double value = 0;
  std::string unit;
  std::string target;  // e.g. ">= 1"; empty: none
  bool holds = true;
};

/// The middle of an odd number of values, or the upper of the two middle ones. Not of none.
inline double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

inline void PrintRows(const std::vector<Row>& rows) {
  for (const Row& row : rows) {
    std::printf("%-58s %10.3f %-10s %-10s %s\n", row.name.c_str(), row.value, row.unit.c_str(),
                row.target.c_str(),
                row.target.empty() ? ""
                : row.holds        ? "holds"
                                   : "MISSED");
  }
}

inline std::string RowsJson(const std::vector<Row>& rows) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const Row& row : rows) {
    json.push_back({{"name", row.name},
                    {"value", row.value},
                    {"unit", row.unit},
                    {"target", row.target},
                    {"holds", row.holds}});
  }
  return json.dump(1) + "\n";
}

}  // namespace carpool::tools
