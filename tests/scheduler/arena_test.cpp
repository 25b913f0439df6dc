// Living with oneTBB: nested parallelism, runs inside runs, arenas of one thread.
#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "carpool/carpool.h"
#include "random_graph.h"

namespace {

using carpool::Batch;
using carpool::Emitter;
using carpool_test::RandomGraph;

TEST(ArenaTest, KernelsMayUseParallelFor) {
  for (const std::uint32_t threads : {1U, 2U, 4U, 8U}) {
    RandomGraph random({.seed = threads, .items = 2000});
    std::atomic<std::uint64_t> inner{0};
    std::atomic<std::uint64_t> batches{0};
    random.on_batch = [&] {
      ++batches;
      tbb::parallel_for(0, 50, [&](int) { ++inner; });
    };
    carpool::run(random.graph(), {.threads = threads, .in_flight = 300});
    EXPECT_EQ(random.counted(), random.expected());
    EXPECT_EQ(inner.load(), 50 * batches.load());
  }
}

// While a kernel waits for its nested loop, its thread must not run another batch of the same
// worker: `busy` would be seen.
TEST(ArenaTest, WorkersAreNotReenteredDuringNestedLoops) {
  RandomGraph random({.seed = 9, .items = 3000, .uneven = true});
  thread_local bool busy = false;
  std::atomic<int> reentered{0};
  random.on_batch = [&] {
    if (busy) {
      ++reentered;
    }
    busy = true;
    tbb::parallel_for(0, 100, [&](int) { std::this_thread::yield(); });
    busy = false;
  };
  carpool::run(random.graph(), {.threads = 8, .in_flight = 1000});
  EXPECT_EQ(reentered.load(), 0);
  EXPECT_EQ(random.counted(), random.expected());
}

TEST(ArenaTest, RunsInsideKernels) {
  tbb::task_arena arena(3);
  carpool::Graph outer;
  const auto stage = outer.add_stage<std::uint32_t>({.name = "outer", .bins = 4, .block_items = 2});
  std::atomic<int> good{0};
  outer.set_kernel(stage, [&](const Batch<std::uint32_t>& batch, Emitter&) {
    for (const std::uint32_t item : batch.items) {
      RandomGraph random({.seed = item, .items = 200});
      carpool::run(random.graph(), {.arena = &arena, .in_flight = 100});
      good += random.counted() == random.expected() ? 1 : 0;
    }
  });
  std::uint32_t next = 0;
  outer.add_source({.name = "s"}, [&](carpool::SourceContext& ctx, Emitter& out) {
    for (std::uint32_t i = 0; i < ctx.budget && next < 60; ++i, ++next) {
      out.emit(stage, next % 4, next);
    }
    return next < 60 ? carpool::SourceStatus::more : carpool::SourceStatus::exhausted;
  });
  carpool::run(outer, {.arena = &arena});
  EXPECT_EQ(good.load(), 60);
}

// Static, because the task may outlive the test; and not captured, because the thread sanitizer
// cannot see how oneTBB hands captures over.
std::atomic<bool> occupied{false};
std::atomic<bool> end_occupation{false};

// An arena whose other threads never come: the caller alone must get everything done.
TEST(ArenaTest, ProgressNeedsNoSecondThread) {
  tbb::task_arena arena(2);
  arena.enqueue([] {
    occupied = true;
    occupied.notify_one();
    end_occupation.wait(false);
  });
  occupied.wait(false);
  RandomGraph random({.seed = 11, .items = 5000});
  carpool::run(random.graph(), {.arena = &arena, .in_flight = 500});
  EXPECT_EQ(random.counted(), random.expected());
  end_occupation = true;
  end_occupation.notify_one();
}

TEST(ArenaTest, ManyShortRuns) {
  tbb::task_arena arena(4);
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    RandomGraph random({.seed = seed, .items = 40, .most_hops = 3});
    carpool::run(random.graph(), {.arena = &arena, .in_flight = 20});
    ASSERT_EQ(random.counted(), random.expected()) << seed;
  }
}

TEST(ArenaTest, ConstraintsAreForArenasOfTheRunItself) {
  tbb::task_arena arena(2);
  RandomGraph random({.seed = 15, .items = 10});
  carpool::RunOptions options{.arena = &arena};
  options.constraints = tbb::task_arena::constraints();
  EXPECT_THROW(carpool::run(random.graph(), options), std::invalid_argument);
}

TEST(ArenaTest, WorkerIndicesAreDense) {
  RandomGraph random({.seed = 12, .items = 5000});
  const auto report = carpool::run(random.graph(), {.threads = 3});
  EXPECT_EQ(report.workers.size(), 3U);
  EXPECT_EQ(carpool::worker_count({.threads = 3}), 3U);
  EXPECT_EQ(carpool::worker_count({.threads = 3, .mode = carpool::RunMode::serial}), 1U);
}

// One long kernel call publishes blocks while it runs; another worker must be called to take them.
// If that did not happen, the call would wait for ever.
TEST(ArenaTest, SleepersAreCalledWhenWorkAppears) {
  carpool::Graph graph;
  std::atomic<bool> other_ran{false};
  const auto lead = graph.add_stage<int>({.name = "lead", .block_items = 1});
  const auto follow = graph.add_stage<int>({.name = "follow", .block_items = 4});
  graph.set_kernel(lead, [&](const Batch<int>&, Emitter& out) {
    for (int round = 0; round < 3; ++round) {
      other_ran = false;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));  // let the others fall asleep
      for (int i = 0; i < 4; ++i) {
        out.emit(follow, 0, i);
      }
      out.emit(follow, 0, 4);  // the first four are published now
      while (!other_ran) {
        std::this_thread::yield();
      }
      for (int i = 0; i < 3; ++i) {
        out.emit(follow, 0, i);
      }
    }
  });
  graph.set_kernel(follow, [&](const Batch<int>&, Emitter&) { other_ran = true; });
  graph.add_source({.name = "s"}, [&](carpool::SourceContext&, Emitter& out) {
    out.emit(lead, 0, 0);
    return carpool::SourceStatus::exhausted;
  });
  const auto report = carpool::run(graph, {.threads = 2});
  EXPECT_EQ(report.stages[1].items, 24U);
}

}  // namespace
