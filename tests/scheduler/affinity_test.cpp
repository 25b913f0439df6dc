// Arenas whose threads stay on some cores: oneTBB's constraints. Not built under sanitizers, which
// refuse the way oneTBB loads its library for that.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>

#include <tbb/info.h>
#include <tbb/task_arena.h>

#include "carpool/carpool.h"
#include "random_graph.h"

namespace {

using carpool_test::RandomGraph;
using Constraints = tbb::task_arena::constraints;

// Each NUMA node, of which most machines have one.
TEST(AffinityTest, TheRunMakesAnArenaWithTheseConstraints) {
  for (const auto node : tbb::info::numa_nodes()) {
    carpool::RunOptions options{.in_flight = 500};
    options.constraints = Constraints().set_numa_id(node);
    RandomGraph random({.seed = 14, .items = 3000});
    const auto report = carpool::run(random.graph(), options);
    EXPECT_EQ(random.counted(), random.expected());
    const int expected = tbb::info::default_concurrency(node);
    EXPECT_EQ(report.workers.size(), static_cast<std::size_t>(expected));
    EXPECT_EQ(carpool::worker_count(options), static_cast<std::uint32_t>(expected));
    options.threads = 1;
    EXPECT_EQ(carpool::worker_count(options), 1U);
  }
}

TEST(AffinityTest, AnArenaOfTheCallersMayHaveThem) {
  for (const auto node : tbb::info::numa_nodes()) {
    tbb::task_arena arena{Constraints().set_numa_id(node)};
    RandomGraph random({.seed = 15, .items = 3000});
    const auto report = carpool::run(random.graph(), {.arena = &arena, .in_flight = 500});
    EXPECT_EQ(random.counted(), random.expected());
    EXPECT_EQ(report.workers.size(),
              static_cast<std::size_t>(tbb::info::default_concurrency(node)));
  }
}

}  // namespace
