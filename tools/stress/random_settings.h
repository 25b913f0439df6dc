// Random shapes of graphs and settings of runs, each from one seed.
#pragma once

#include <cstdint>

#include "carpool/carpool.h"
#include "random_graph.h"

namespace carpool_test {

Shape random_shape(std::uint64_t seed);
carpool::RunOptions random_options(std::uint64_t seed, std::uint32_t threads);

}  // namespace carpool_test
