// Whatever the graph, every item is handled exactly once, and memory stays within the formula.
#include "random_graph.h"
#include "random_settings.h"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <thread>

namespace {

using carpool_test::random_options;
using carpool_test::random_shape;
using carpool_test::RandomGraph;
using carpool_test::Shape;

void check(const Shape& shape, const carpool::RunOptions& options) {
  SCOPED_TRACE("shape's seed " + std::to_string(shape.seed));
  RandomGraph random(shape);
  carpool::RunReport report;
  ASSERT_NO_THROW(report = carpool::run(random.graph(), options));
  random.forbid_calls();
  EXPECT_EQ(random.counted(), random.expected()) << "seed " << shape.seed;
  EXPECT_TRUE(random.caps_held()) << "seed " << shape.seed;
  EXPECT_EQ(report.outcome, carpool::Outcome::completed);
  EXPECT_LE(report.peak_bytes, report.worst_case_bytes) << "seed " << shape.seed;
  EXPECT_EQ(report.worst_case_bytes, carpool::worst_case_bytes(random.graph(), options));
  EXPECT_EQ(report.overflow_blocks, 0U);
  EXPECT_EQ(report.dropped_items, 0U);
  std::uint64_t visits = 0;
  for (const auto& stage : report.stages) {
    visits += stage.items;
  }
  EXPECT_EQ(visits, random.expected().visits);
}

class RandomGraphTest : public testing::TestWithParam<std::uint32_t> {};

TEST_P(RandomGraphTest, HandlesEveryItemOnce) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    check(random_shape(seed * 100 + GetParam()),
          random_options(seed * 100 + GetParam(), GetParam()));
    if (HasFailure()) {
      return;  // the first failing seed is enough to look at
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Threads, RandomGraphTest, testing::Values(1, 2, 3, 4, 8, 16));

TEST(RandomGraphTest, Serial) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    carpool::RunOptions options = random_options(seed, 1);
    options.mode = carpool::RunMode::serial;
    check(random_shape(seed), options);
  }
}

TEST(RandomGraphTest, TenCreditsAndSixteenThreads) {
  check({.seed = 5, .most_bins = 1000, .items = 20'000}, {.threads = 16, .in_flight = 10});
}

TEST(RandomGraphTest, OneCredit) {
  check({.seed = 6}, {.threads = 4, .in_flight = 1});
}

TEST(RandomGraphTest, ThousandsOfBins) {
  check({.seed = 7, .most_bins = 65'536, .items = 30'000}, {.threads = 4, .in_flight = 10'000});
}

TEST(RandomGraphTest, FanOutToTheLimit) {
  check({.seed = 8, .items = 20'000, .most_hops = 6, .fan_out = 64, .split_early = true},
        {.threads = 4, .in_flight = 4096});
}

TEST(RandomGraphTest, TwoRunsAtOnceShareAnArena) {
  tbb::task_arena arena(4);
  for (std::uint64_t round = 0; round < 20; ++round) {
    std::array<std::thread, 2> callers;
    for (std::uint64_t i = 0; i < callers.size(); ++i) {
      callers[i] = std::thread([&arena, seed = 2 * round + i] {
        check({.seed = seed, .items = 3000, .uneven = true}, {.arena = &arena, .in_flight = 1000});
      });
    }
    for (std::thread& caller : callers) {
      caller.join();
    }
  }
}

}  // namespace
