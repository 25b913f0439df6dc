// Stages with a cap on their calls, and stages that block on threads of their own.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <barrier>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "carpool/carpool.h"
#include "random_graph.h"

namespace {

using carpool::Batch;
using carpool::Emitter;
using carpool::SourceContext;
using carpool::SourceStatus;
using carpool_test::RandomGraph;

using Numbers = carpool::StageHandle<std::uint32_t>;

// A source of the numbers below `count`, each to bin number % bins.
void add_numbers(carpool::Graph& graph, Numbers to, std::uint32_t count) {
  graph.add_source({.name = "numbers"}, [=, next = 0U](SourceContext& ctx, Emitter& out) mutable {
    for (std::uint32_t i = 0; i < ctx.budget && next < count; ++i, ++next) {
      out.emit(to, next % to.bins(), next);
    }
    return next < count ? SourceStatus::more : SourceStatus::exhausted;
  });
}

class CapTest : public testing::TestWithParam<std::uint32_t> {};

// What a serial stage writes has no lock: the thread sanitizer sees it if two calls overlap, or if
// one does not see what the other wrote.
TEST_P(CapTest, ASerialStageNeedsNoLock) {
  constexpr std::uint32_t kCount = 50'000;
  carpool::Graph graph;
  const Numbers spread = graph.add_stage<std::uint32_t>({.name = "spread", .bins = 16});
  const Numbers serial = graph.add_stage<std::uint32_t>(
      {.name = "serial", .bins = 5, .block_items = 32, .rank = 1, .concurrency = 1});
  std::vector<std::uint32_t> seen;
  std::uint64_t sum = 0;
  graph.set_kernel(spread, [&](const Batch<std::uint32_t>& batch, Emitter& out) {
    for (const std::uint32_t number : batch.items) {
      out.emit(serial, number % 5, number);
    }
  });
  graph.set_kernel(serial, [&](const Batch<std::uint32_t>& batch, Emitter&) {
    for (const std::uint32_t number : batch.items) {
      EXPECT_EQ(number % 5, batch.bin);
      seen.push_back(number);
      sum += number;
    }
  });
  add_numbers(graph, spread, kCount);
  const auto report = carpool::run(graph, {.threads = GetParam(), .in_flight = 4000});
  EXPECT_EQ(sum, std::uint64_t{kCount} * (kCount - 1) / 2);
  std::sort(seen.begin(), seen.end());
  ASSERT_EQ(seen.size(), kCount);
  EXPECT_TRUE(std::adjacent_find(seen.begin(), seen.end()) == seen.end());
  EXPECT_LE(report.peak_bytes, report.worst_case_bytes);
}

// Partial blocks of several workers become one while they wait for their turn.
TEST_P(CapTest, RandomGraphsWithCaps) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    RandomGraph random({.seed = seed,
                        .block_items = seed % 2 == 0 ? 5U : 64U,
                        .items = 3000,
                        .fan_out = seed % 3 == 0 ? 4U : 1U,
                        .uneven = true,
                        .caps = true});
    const auto report = carpool::run(random.graph(), {.threads = GetParam(), .in_flight = 700});
    ASSERT_EQ(random.counted(), random.expected()) << "seed " << seed;
    ASSERT_TRUE(random.caps_held()) << "seed " << seed;
    ASSERT_LE(report.peak_bytes, report.worst_case_bytes) << "seed " << seed;
  }
}
INSTANTIATE_TEST_SUITE_P(Threads, CapTest, testing::Values(1, 2, 3, 8));

// A cap of two lets two calls run at once: the first waits until there is another.
TEST(CapTest, TwoCallsOfATwoWideStageMeet) {
  carpool::Graph graph;
  const Numbers wide =
      graph.add_stage<std::uint32_t>({.name = "wide", .block_items = 1, .concurrency = 2});
  std::atomic<std::uint32_t> begun{0};
  graph.set_kernel(wide, [&](const Batch<std::uint32_t>&, Emitter&) {
    if (++begun == 2) {
      begun.notify_all();
    }
    begun.wait(1);
  });
  add_numbers(graph, wide, 100);
  EXPECT_EQ(carpool::run(graph, {.threads = 3}).stages[0].items, 100U);
}

class BlockingTest : public testing::TestWithParam<std::uint32_t> {};

// All four threads of the stage must be inside at once, whatever the number of workers.
TEST_P(BlockingTest, HasThreadsOfItsOwn) {
  carpool::Graph graph;
  const Numbers wait = graph.add_stage<std::uint32_t>(
      {.name = "wait", .block_items = 1, .concurrency = 4, .blocking = true});
  const Numbers after = graph.add_stage<std::uint32_t>({.name = "after"});
  std::barrier all(4);
  std::set<std::thread::id> threads;
  std::set<std::uint32_t> workers;
  std::mutex mutex;
  graph.set_kernel(wait, [&](const Batch<std::uint32_t>& batch, Emitter& out) {
    all.arrive_and_wait();
    out.emit(after, 0, batch.items);
    const std::lock_guard guard(mutex);
    threads.insert(std::this_thread::get_id());
    workers.insert(batch.worker);
  });
  std::atomic<std::uint32_t> got{0};
  graph.set_kernel(after, [&](const Batch<std::uint32_t>& batch, Emitter&) {
    EXPECT_LT(batch.worker, GetParam());
    got += static_cast<std::uint32_t>(batch.items.size());
  });
  add_numbers(graph, wait, 100);
  const carpool::RunOptions options{.threads = GetParam(), .in_flight = 30};
  const auto report = carpool::run(graph, options);
  EXPECT_EQ(got.load(), 100U);
  EXPECT_EQ(threads.size(), 4U);
  EXPECT_FALSE(threads.contains(std::this_thread::get_id()));
  EXPECT_EQ(workers.size(), 4U);  // dense, and apart from those of the workers
  EXPECT_EQ(*workers.begin(), GetParam());
  EXPECT_EQ(carpool::worker_count(graph, options), GetParam() + 4);
  EXPECT_EQ(report.workers.size(), GetParam());
  EXPECT_EQ(report.blocking_threads.size(), 4U);
}

// A call of the blocking stage ends only when a worker has run something meanwhile.
TEST_P(BlockingTest, WorkersGoOnWhileItWaits) {
  carpool::Graph graph;
  const Numbers wait = graph.add_stage<std::uint32_t>(
      {.name = "wait", .block_items = 1, .concurrency = 1, .blocking = true});
  const Numbers other = graph.add_stage<std::uint32_t>({.name = "other", .block_items = 1});
  std::atomic<std::uint32_t> ran{0};
  graph.set_kernel(wait, [&](const Batch<std::uint32_t>& batch, Emitter&) {
    for (std::uint32_t seen = ran; seen <= batch.items.front(); seen = ran) {
      ran.wait(seen);
    }
  });
  graph.set_kernel(other, [&](const Batch<std::uint32_t>&, Emitter&) {
    ++ran;
    ran.notify_all();
  });
  graph.add_source({.name = "both"}, [&, next = 0U](SourceContext&, Emitter& out) mutable {
    out.emit(wait, 0, next);
    return ++next < 40 ? SourceStatus::more : SourceStatus::exhausted;
  });
  graph.add_source({.name = "others"}, [&, next = 0U](SourceContext&, Emitter& out) mutable {
    out.emit(other, 0, next);
    return ++next < 40 ? SourceStatus::more : SourceStatus::exhausted;
  });
  const auto report = carpool::run(graph, {.threads = GetParam(), .in_flight = 100});
  EXPECT_EQ(report.stages[0].items, 40U);
}

// The only credit is with an item that waits, so everybody sleeps; when it comes back, somebody
// must wake to call the source. Done a few thousand times, for the race between the two.
TEST_P(BlockingTest, CreditsThatComeBackWakeTheSource) {
  carpool::Graph graph;
  const Numbers wait = graph.add_stage<std::uint32_t>(
      {.name = "wait", .block_items = 1, .concurrency = 2, .blocking = true});
  graph.set_kernel(wait, [](const Batch<std::uint32_t>& batch, Emitter&) {
    if (batch.items.front() % 7 == 0) {
      std::this_thread::sleep_for(std::chrono::microseconds(batch.items.front() % 50));
    }
  });
  add_numbers(graph, wait, 3000);
  const auto report = carpool::run(graph, {.threads = GetParam(), .in_flight = 1});
  EXPECT_EQ(report.stages[0].items, 3000U);
}

TEST_P(BlockingTest, RandomGraphs) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    RandomGraph random({.seed = seed,
                        .block_items = seed % 2 == 0 ? 1U : 16U,
                        .items = 1000,
                        .fan_out = seed % 3 == 0 ? 4U : 1U,
                        .caps = seed % 4 == 0,
                        .blocking = true});
    const auto report = carpool::run(
        random.graph(), {.threads = GetParam(), .in_flight = seed % 5 == 0 ? 5U : 300U});
    ASSERT_EQ(random.counted(), random.expected()) << "seed " << seed;
    ASSERT_TRUE(random.caps_held()) << "seed " << seed;
    ASSERT_LE(report.peak_bytes, report.worst_case_bytes) << "seed " << seed;
    ASSERT_EQ(report.dropped_items, 0U);
  }
}

TEST_P(BlockingTest, AnExceptionEndsTheRun) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    RandomGraph random({.seed = seed, .items = 3000, .caps = true, .blocking = true});
    std::atomic<std::uint64_t> left{seed * 5};
    random.on_batch = [&] {
      if (left.fetch_sub(1) == 0) {
        throw std::runtime_error("kernel " + std::to_string(seed));
      }
    };
    try {
      carpool::run(random.graph(), {.threads = GetParam(), .in_flight = 200});
      FAIL() << "no exception";
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(error.what(), "kernel " + std::to_string(seed));
    }
    random.forbid_calls();
    std::this_thread::yield();
    EXPECT_EQ(random.late_calls(), 0U);
  }
}

// Cancelled, or at its deadline, while everything waits for blocking calls.
TEST_P(BlockingTest, CancelAndDeadlineEndTheRun) {
  for (const bool by_deadline : {false, true}) {
    carpool::Graph graph;
    const Numbers wait = graph.add_stage<std::uint32_t>(
        {.name = "wait", .block_items = 1, .concurrency = 3, .blocking = true});
    const carpool::CancelToken token;
    std::atomic<std::uint32_t> calls{0};
    graph.set_kernel(wait, [&](const Batch<std::uint32_t>&, Emitter&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (++calls == 5 && !by_deadline) {
        token.cancel();
      }
    });
    add_numbers(graph, wait, 1'000'000);
    carpool::RunOptions options{.threads = GetParam(), .in_flight = 100, .cancel = token};
    if (by_deadline) {
      options.deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(10);
    }
    const auto report = carpool::run(graph, options);
    EXPECT_EQ(report.outcome,
              by_deadline ? carpool::Outcome::deadline : carpool::Outcome::cancelled);
    EXPECT_GT(report.dropped_items, 0U);
    if (!by_deadline) {
      EXPECT_LE(calls.load(), 5U + 2U + 3U);  // whoever had begun one may finish it
    }
  }
}

TEST_P(BlockingTest, ProgressIsReportedWhileAllWorkersSleep) {
  carpool::Graph graph;
  const Numbers wait = graph.add_stage<std::uint32_t>(
      {.name = "wait", .block_items = 1, .concurrency = 1, .blocking = true});
  std::atomic<bool> told{false};
  graph.set_kernel(wait, [&](const Batch<std::uint32_t>&, Emitter&) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  graph.add_source({.name = "until told", .fan_out = 1}, [&](SourceContext&, Emitter& out) {
    if (told) {
      return SourceStatus::exhausted;
    }
    out.emit(wait, 0, 1U);
    return SourceStatus::more;
  });
  carpool::RunOptions options{.threads = GetParam(), .in_flight = 3};
  options.progress_every = std::chrono::milliseconds(2);
  options.progress = [&](const carpool::Progress& progress) { told = progress.item_visits > 3; };
  carpool::run(graph, options);
  EXPECT_TRUE(told);
}
INSTANTIATE_TEST_SUITE_P(Threads, BlockingTest, testing::Values(1, 2, 8));

TEST(BlockingTest, TwoRunsAndNestedOnesShareAnArena) {
  tbb::task_arena arena(3);
  std::vector<std::thread> callers;
  for (std::uint64_t i = 0; i < 3; ++i) {
    callers.emplace_back([&arena, i] {
      for (std::uint64_t round = 0; round < 15; ++round) {
        RandomGraph random({.seed = 3 * round + i, .items = 500, .caps = true, .blocking = i != 0});
        carpool::run(random.graph(), {.arena = &arena, .in_flight = 100});
        ASSERT_EQ(random.counted(), random.expected());
      }
    });
  }
  for (std::thread& caller : callers) {
    caller.join();
  }
}

TEST(BlockingTest, InSerialRunsTheCallerDoesAll) {
  RandomGraph random({.seed = 5, .items = 2000, .caps = true, .blocking = true});
  const auto caller = std::this_thread::get_id();
  random.on_batch = [&] { EXPECT_EQ(std::this_thread::get_id(), caller); };
  carpool::run(random.graph(), {.in_flight = 100, .mode = carpool::RunMode::serial});
  EXPECT_EQ(random.counted(), random.expected());
}

// In virtual time, four threads that wait a second each for sixteen items take four seconds.
TEST(BlockingTest, SimulatedWaitsOverlap) {
  carpool::Graph graph;
  const Numbers wait = graph.add_stage<std::uint32_t>(
      {.name = "wait", .block_items = 1, .concurrency = 4, .blocking = true});
  graph.set_kernel(wait, [](const Batch<std::uint32_t>&, Emitter&) {});
  add_numbers(graph, wait, 16);
  carpool::RunOptions options{.threads = 1, .mode = carpool::RunMode::simulated};
  options.simulation.batch_seconds = [](std::uint32_t, std::uint32_t items) { return 1.0 * items; };
  options.simulation.jitter = 0;
  EXPECT_NEAR(carpool::run(graph, options).seconds, 4.0, 0.01);
}

TEST(BlockingTest, WithoutAnyThreadItIsRefused) {
  carpool::Graph graph;
  EXPECT_THROW(graph.add_stage<int>({.name = "read", .blocking = true}), std::invalid_argument);
}

}  // namespace
