// The benchmark page: one HTML file that needs nothing else.
#pragma once

#include <string>
#include <vector>

#include "tools/bench/scene_bench.h"

namespace carpool::tools {

/// `skipped`: one line for each scene that could not be measured. What misses its target is red.
std::string Page(const BenchOptions& options, const std::vector<SceneFigures>& scenes,
                 const std::vector<std::string>& skipped);

}  // namespace carpool::tools
