// Simulated runs: real results, the same batch for batch under one seed, and a scheduler that never
// comes to a standstill.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "carpool/carpool.h"
#include "random_graph.h"

namespace {

using carpool_test::mix;
using carpool_test::RandomGraph;
using carpool_test::Shape;

carpool::RunOptions simulated(std::uint32_t workers, std::uint64_t seed) {
  carpool::RunOptions options{
      .threads = workers, .in_flight = 1000, .mode = carpool::RunMode::simulated};
  options.simulation.seed = seed;
  return options;
}

TEST(SimulationTest, ThousandsOfInterleavingsHandleEveryItemOnce) {
  for (std::uint64_t seed = 1; seed <= 1500; ++seed) {
    const std::uint64_t dice = mix(seed);
    const Shape shape{.seed = seed,
                      .stages = static_cast<std::uint32_t>(1 + dice % 4),
                      .most_bins = (dice >> 8) % 2 == 0 ? 3U : 40U,
                      .block_items = (dice >> 16) % 2 == 0 ? 2U : 16U,
                      .sources = static_cast<std::uint32_t>(1 + (dice >> 20) % 2),
                      .items = 100,
                      .most_hops = 5,
                      .fan_out = (dice >> 24) % 2 == 0 ? 1U : 4U,
                      .split_early = (dice >> 32) % 2 == 0,
                      .caps = (dice >> 36) % 2 == 0,
                      .blocking = (dice >> 38) % 2 == 0};
    RandomGraph random(shape);
    auto options = simulated(static_cast<std::uint32_t>(1 + (dice >> 40) % 9), seed);
    options.in_flight = 4 + (dice >> 48) % 200;
    // Waking takes between no time and longer than the whole run.
    options.simulation.wake_seconds = 1e-7 * static_cast<double>(1ULL << (dice >> 56) % 12);
    const auto report = carpool::run(random.graph(), options);
    ASSERT_EQ(random.counted(), random.expected()) << "seed " << seed;
    ASSERT_LE(report.peak_bytes, report.worst_case_bytes) << "seed " << seed;
    ASSERT_TRUE(random.caps_held()) << "seed " << seed;
  }
}

// What ran where and when, in order.
std::string history(std::uint64_t seed) {
  RandomGraph random({.seed = 3, .items = 3000, .uneven = true, .caps = true, .blocking = true});
  const auto report = carpool::run(random.graph(), simulated(7, seed));
  return report.to_json();
}

TEST(SimulationTest, OneSeedIsOneRun) {
  const std::string first = history(42);
  EXPECT_EQ(first, history(42));
  EXPECT_NE(first, history(43));
}

TEST(SimulationTest, ExceptionsAndCancelEndIt) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const Shape shape{.seed = seed, .items = 2000, .caps = true, .blocking = seed % 2 == 0};
    RandomGraph random(shape);
    std::uint64_t left = mix(seed) % 100;
    random.on_batch = [&] {
      if (left-- == 0) {
        throw seed;
      }
    };
    EXPECT_THROW(carpool::run(random.graph(), simulated(5, seed)), std::uint64_t);

    RandomGraph second(shape);
    auto options = simulated(5, seed);
    options.cancel = carpool::CancelToken();
    left = mix(seed) % 100;
    second.on_batch = [&] {
      if (left-- == 0) {
        options.cancel.cancel();
      }
    };
    EXPECT_EQ(carpool::run(second.graph(), options).outcome, carpool::Outcome::cancelled);
  }
}

// Virtual time is not the machine's: this run takes an hour.
TEST(SimulationTest, MoreWorkersAreFaster) {
  const auto seconds = [](std::uint32_t workers) {
    RandomGraph random({.seed = 8, .stages = 2, .most_bins = 4, .block_items = 16, .items = 4000});
    auto options = simulated(workers, 1);
    options.simulation.batch_seconds = [](std::uint32_t, std::uint32_t items) {
      return 0.1 * items;
    };
    options.simulation.jitter = 0;
    return carpool::run(random.graph(), options).seconds;
  };
  const double one = seconds(1);
  EXPECT_GT(one, 1000);
  EXPECT_LT(seconds(8), one / 6);
  EXPECT_LT(seconds(64), seconds(8));
}

// A source, and a stage whose every item, a block of its own, becomes one of the next stage.
carpool::RunReport run_chain(std::uint32_t workers, const carpool::Simulation& simulation) {
  carpool::Graph graph;
  const auto last = graph.add_stage<int>({.name = "last", .block_items = 1});
  const auto first = graph.add_stage<int>({.name = "first", .block_items = 1});
  graph.set_kernel(last, [](const carpool::Batch<int>&, carpool::Emitter&) {});
  graph.set_kernel(first, [&](const carpool::Batch<int>& batch, carpool::Emitter& out) {
    out.emit(last, 0, batch.items);
  });
  int next = 0;
  graph.add_source({.name = "s"}, [&](carpool::SourceContext&, carpool::Emitter& out) {
    out.emit(first, 0, next);
    return ++next < 1000 ? carpool::SourceStatus::more : carpool::SourceStatus::exhausted;
  });
  auto options = simulated(workers, 1);
  options.simulation = simulation;
  return carpool::run(graph, options);
}

// One worker, 2,000 blocks of one item: what is published, and not run at once, takes a second.
TEST(SimulationTest, PublishingTakesItsTime) {
  carpool::Simulation costs{.batch_seconds = [](std::uint32_t, std::uint32_t) { return 0.0; },
                            .source_item_seconds = 0,
                            .choose_seconds = 0,
                            .publish_seconds = 0,
                            .jitter = 0};
  EXPECT_LT(run_chain(1, costs).seconds, 1);
  costs.publish_seconds = 1;
  const carpool::RunReport report = run_chain(1, costs);
  double published = 0;
  for (const carpool::StageReport& stage : report.stages) {
    published += static_cast<double>(
        stage.flushes_by_cause[static_cast<std::size_t>(carpool::FlushCause::full)]);
  }
  EXPECT_GT(published, 1990);
  EXPECT_NEAR(report.seconds, published, 1);
}

// 1,000 batches of either stage want 3 bytes and a second each: 8 workers could do them in 250
// seconds, but memory gives no more than 6 bytes a second.
TEST(SimulationTest, WorkersShareMemory) {
  carpool::Simulation costs{.batch_seconds = [](std::uint32_t, std::uint32_t) { return 1.0; },
                            .batch_bytes = [](std::uint32_t, std::uint32_t) { return 3.0; },
                            .memory_bytes_per_second = 6,
                            .jitter = 0};
  EXPECT_NEAR(run_chain(1, costs).seconds, 2000, 1);
  EXPECT_NEAR(run_chain(2, costs).seconds, 1000, 20);
  EXPECT_NEAR(run_chain(8, costs).seconds, 1000, 20);
  costs.memory_bytes_per_second = 1e9;
  EXPECT_NEAR(run_chain(8, costs).seconds, 250, 20);
  costs.memory_bytes_per_second = 0;
  EXPECT_THROW(run_chain(8, costs), std::invalid_argument);
}

// A deadline in virtual time: an endless graph ends after a simulated hour.
TEST(SimulationTest, DeadlinesAreVirtual) {
  carpool::Graph graph;
  const auto stage = graph.add_stage<int>({.name = "forever"});
  graph.set_kernel(stage, [&](const carpool::Batch<int>& batch, carpool::Emitter& out) {
    out.emit(stage, 0, batch.items);
  });
  graph.add_source({.name = "s"}, [&](carpool::SourceContext&, carpool::Emitter& out) {
    out.emit(stage, 0, 1);
    return carpool::SourceStatus::exhausted;
  });
  auto options = simulated(2, 1);
  options.simulation.batch_seconds = [](std::uint32_t, std::uint32_t) { return 60.0; };
  options.deadline = std::chrono::steady_clock::now() + std::chrono::hours(1);
  const auto report = carpool::run(graph, options);
  EXPECT_EQ(report.outcome, carpool::Outcome::deadline);
  EXPECT_GT(report.seconds, 3000);
}

}  // namespace
