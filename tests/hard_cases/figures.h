// The figures that the suite measures, kept for --json.
#pragma once

#include <string>
#include <vector>

#include "tools/bench/rows.h"

namespace carpool::test {

/// Every figure recorded so far, in order.
inline std::vector<tools::Row>& Figures() {
  static std::vector<tools::Row> figures;
  return figures;
}

inline void RecordFigure(const std::string& name, double value, const std::string& unit,
                         bool holds) {
  Figures().push_back({name, value, unit, "p >= 1e-6", holds});
}

}  // namespace carpool::test
