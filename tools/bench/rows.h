// Figures of a benchmark: a table for people, and rows of JSON for scripts.
#pragma once

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
