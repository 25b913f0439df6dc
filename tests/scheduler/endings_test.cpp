// How runs end before their time: exceptions, cancel, drain, deadline, overflow.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>

#include "carpool/carpool.h"
#include "random_graph.h"

namespace {

using carpool::Batch;
using carpool::Emitter;
using carpool::SourceContext;
using carpool::SourceStatus;
using carpool_test::RandomGraph;

struct Setting {
  carpool::RunMode mode;
  std::uint32_t threads;
};

class EndingsTest : public testing::TestWithParam<Setting> {
 protected:
  carpool::RunOptions options() const {
    return {.threads = GetParam().threads, .in_flight = 5000, .mode = GetParam().mode};
  }
};

TEST_P(EndingsTest, AnExceptionOfAKernelArrivesOnceAndNothingRunsAfterIt) {
  for (std::uint64_t round = 1; round <= 20; ++round) {
    RandomGraph random({.seed = round, .items = 20'000});
    std::atomic<std::uint64_t> batches{0};
    random.on_batch = [&] {
      if (batches.fetch_add(1) == round * 3) {
        throw std::runtime_error("kernel " + std::to_string(round));
      }
    };
    try {
      carpool::run(random.graph(), options());
      FAIL() << "no exception";
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(error.what(), "kernel " + std::to_string(round));
    }
    random.forbid_calls();
    std::this_thread::yield();
    EXPECT_EQ(random.late_calls(), 0U);
  }
}

TEST_P(EndingsTest, OnlyTheFirstOfManyExceptionsArrives) {
  RandomGraph random({.seed = 3, .items = 20'000});
  random.on_batch = [] { throw std::string("thrown by every batch"); };
  EXPECT_THROW(carpool::run(random.graph(), options()), std::string);
}

TEST_P(EndingsTest, AnExceptionOfASourceArrives) {
  carpool::Graph graph;
  const auto stage = graph.add_stage<int>({.name = "s"});
  graph.set_kernel(stage, [](const Batch<int>&, Emitter&) {});
  graph.add_source({.name = "bad"}, [&](SourceContext&, Emitter& out) -> SourceStatus {
    out.emit(stage, 0, 1);
    throw std::domain_error("source");
  });
  EXPECT_THROW(carpool::run(graph, options()), std::domain_error);
}

TEST_P(EndingsTest, CancelledFromAKernel) {
  RandomGraph random({.seed = 4, .items = 200'000});
  const carpool::CancelToken token;
  std::atomic<int> batches{0};
  random.on_batch = [&] {
    if (batches.fetch_add(1) == 20) {
      token.cancel();
    }
  };
  carpool::RunOptions with_token = options();
  with_token.cancel = token;
  const auto report = carpool::run(random.graph(), with_token);
  random.forbid_calls();
  EXPECT_EQ(report.outcome, carpool::Outcome::cancelled);
  // Bounded by one batch: whoever had begun one may finish it.
  const auto workers = static_cast<int>(report.workers.size());
  EXPECT_LE(batches.load(), 21 + workers + workers);
  EXPECT_GT(report.dropped_items, 0U);
  EXPECT_EQ(random.late_calls(), 0U);
}

TEST_P(EndingsTest, CancelledBeforeItBegins) {
  RandomGraph random({.seed = 5});
  const carpool::CancelToken token;
  token.cancel();
  carpool::RunOptions with_token = options();
  with_token.cancel = token;
  EXPECT_EQ(carpool::run(random.graph(), with_token).outcome, carpool::Outcome::cancelled);
  EXPECT_EQ(random.counted().visits, 0U);
}

TEST_P(EndingsTest, DrainStopsSourcesAndFinishesTheRest) {
  // Each item hops four times; all that began must end.
  carpool::Graph graph;
  const auto stage = graph.add_stage<std::uint32_t>({.name = "hop", .bins = 7});
  const carpool::CancelToken token;
  std::atomic<std::uint64_t> born{0};
  std::atomic<std::uint64_t> retired{0};
  graph.set_kernel(stage, [&](const Batch<std::uint32_t>& batch, Emitter& out) {
    for (const std::uint32_t left : batch.items) {
      if (left > 0) {
        out.emit(stage, left, left - 1);
      } else if (retired.fetch_add(1) == 1000) {
        token.drain();
      }
    }
  });
  graph.add_source({.name = "endless"}, [&](SourceContext& ctx, Emitter& out) {
    for (std::uint32_t i = 0; i < ctx.budget; ++i) {
      out.emit(stage, 3, std::uint32_t{3});
    }
    born += ctx.budget;
    return SourceStatus::more;
  });
  carpool::RunOptions with_token = options();
  with_token.cancel = token;
  const auto report = carpool::run(graph, with_token);
  EXPECT_EQ(report.outcome, carpool::Outcome::drained);
  EXPECT_EQ(born.load(), retired.load());
  EXPECT_EQ(report.dropped_items, 0U);
}

TEST_P(EndingsTest, TheDeadlineEndsAnEndlessRun) {
  carpool::Graph graph;
  const auto stage = graph.add_stage<std::uint32_t>({.name = "forever", .bins = 5});
  graph.set_kernel(stage, [&](const Batch<std::uint32_t>& batch, Emitter& out) {
    for (const std::uint32_t item : batch.items) {
      out.emit(stage, (item + 1) % 5, item + 1);
    }
  });
  graph.add_source({.name = "s"}, [&](SourceContext& ctx, Emitter& out) {
    for (std::uint32_t i = 0; i < ctx.budget; ++i) {
      out.emit(stage, i % 5, i);
    }
    return SourceStatus::more;
  });
  carpool::RunOptions with_deadline = options();
  with_deadline.deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(20);
  const auto report = carpool::run(graph, with_deadline);
  EXPECT_EQ(report.outcome, carpool::Outcome::deadline);
  EXPECT_GE(std::chrono::steady_clock::now(), *with_deadline.deadline);
}

// One item becomes a million, though it was declared to stay one. Its children wait until all are
// made, or the attempt has failed, so that they really are alive at once.
class Flood {
 public:
  static constexpr std::uint32_t kItems = 1'000'000;

  Flood() {
    const auto stage = graph.add_stage<std::uint64_t>({.name = "flood", .bins = 3});
    graph.set_kernel(stage, [this, stage](const Batch<std::uint64_t>& batch, Emitter& out) {
      if (batch.items.front() != 0) {
        ended.wait(false);
        return;
      }
      try {
        for (; made < kItems; ++made) {
          out.emit(stage, made % 3, std::uint64_t{1});
        }
      } catch (...) {
        end();
        throw;
      }
      end();
    });
    graph.add_source({.name = "one"}, [stage](SourceContext&, Emitter& out) {
      out.emit(stage, 0, std::uint64_t{0});
      return SourceStatus::exhausted;
    });
  }

  carpool::Graph graph;
  std::uint32_t made = 0;

 private:
  void end() {
    ended = true;
    ended.notify_all();
  }
  std::atomic<bool> ended{false};
};

TEST_P(EndingsTest, MoreThanTheDeclaredFanOutFails) {
  Flood flood;
  EXPECT_THROW(carpool::run(flood.graph, options()), carpool::OverflowError);
  EXPECT_LT(flood.made, Flood::kItems);
}

TEST_P(EndingsTest, MoreThanTheDeclaredFanOutGrowsOnRequest) {
  Flood flood;
  carpool::RunOptions growing = options();
  growing.overflow = carpool::Overflow::grow;
  const auto report = carpool::run(flood.graph, growing);
  EXPECT_EQ(report.stages[0].items, Flood::kItems + 1U);
  EXPECT_GT(report.overflow_blocks, 0U);
  EXPECT_GT(report.peak_bytes, report.worst_case_bytes);
  EXPECT_FALSE(report.notes.empty());
}

TEST_P(EndingsTest, MoreThanTheDeclaredFanOutGoesToAFileOnRequest) {
  Flood flood;
  carpool::RunOptions spilling = options();
  spilling.overflow = carpool::Overflow::spill;
  const auto report = carpool::run(flood.graph, spilling);
  EXPECT_EQ(report.stages[0].items, Flood::kItems + 1U);
  EXPECT_EQ(report.overflow_blocks, 0U);
  EXPECT_GT(report.spilled_blocks, 0U);
  EXPECT_GT(report.peak_spill_bytes, Flood::kItems / 2 * sizeof(std::uint64_t));
  EXPECT_LE(report.peak_bytes, report.worst_case_bytes);
}

TEST_P(EndingsTest, ASourceThatExceedsItsBudgetIsRefused) {
  carpool::Graph graph;
  const auto stage = graph.add_stage<int>({.name = "s"});
  graph.set_kernel(stage, [](const Batch<int>&, Emitter&) {});
  graph.add_source({.name = "greedy"}, [&](SourceContext& ctx, Emitter& out) {
    for (std::uint32_t i = 0; i <= ctx.budget; ++i) {
      out.emit(stage, 0, 1);
    }
    return SourceStatus::more;
  });
  EXPECT_THROW(carpool::run(graph, options()), std::logic_error);
}

INSTANTIATE_TEST_SUITE_P(
    Modes, EndingsTest,
    testing::Values(Setting{carpool::RunMode::serial, 0}, Setting{carpool::RunMode::threads, 1},
                    Setting{carpool::RunMode::threads, 2}, Setting{carpool::RunMode::threads, 8}),
    [](const auto& info) {
      return (info.param.mode == carpool::RunMode::serial ? "serial" : "threads") +
             std::to_string(info.param.threads);
    });

}  // namespace
