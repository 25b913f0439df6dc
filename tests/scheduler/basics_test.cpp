// What the manual promises, feature by feature.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <numeric>
#include <utility>
#include <vector>

#include "carpool/carpool.h"

namespace {

using carpool::Batch;
using carpool::Emitter;
using carpool::SourceContext;
using carpool::SourceStatus;

// Counts from 0 to `count`, then is exhausted. One worker at a time.
auto counting_source(carpool::StageHandle<std::uint32_t> to, std::uint32_t count,
                     std::uint32_t bins) {
  return [=, next = std::uint32_t{0}](SourceContext& ctx, Emitter& out) mutable {
    for (std::uint32_t i = 0; i < ctx.budget && next < count; ++i, ++next) {
      out.emit(to, next % bins, next);
    }
    return next < count ? SourceStatus::more : SourceStatus::exhausted;
  };
}

struct Setting {
  carpool::RunMode mode;
  std::uint32_t threads;
};

class BasicsTest : public testing::TestWithParam<Setting> {
 protected:
  carpool::RunOptions options() const {
    return {.threads = GetParam().threads, .mode = GetParam().mode};
  }
};

TEST_P(BasicsTest, EveryItemIsHandledOnce) {
  constexpr std::uint32_t kCount = 100'000;
  std::vector<std::atomic<int>> seen(kCount);
  carpool::Graph graph;
  const auto stage = graph.add_stage<std::uint32_t>({.name = "count", .bins = 17});
  graph.set_kernel(stage, [&](const Batch<std::uint32_t>& batch, Emitter&) {
    EXPECT_FALSE(batch.items.empty());
    for (const std::uint32_t item : batch.items) {
      EXPECT_EQ(batch.bin, item % 17);
      seen[item].fetch_add(1);
    }
  });
  const auto source = graph.add_source({.name = "numbers"}, counting_source(stage, kCount, 17));
  graph.add_edge(source, stage);
  const carpool::RunReport report = carpool::run(graph, options());
  for (const auto& count : seen) {
    ASSERT_EQ(count.load(), 1);
  }
  EXPECT_EQ(report.outcome, carpool::Outcome::completed);
  EXPECT_EQ(report.stages[0].items, kCount);
  EXPECT_LE(report.peak_bytes, report.worst_case_bytes);
}

TEST_P(BasicsTest, CyclesEnd) {
  constexpr std::uint32_t kCount = 20'000;
  std::atomic<std::uint64_t> hops{0};
  carpool::Graph graph;
  struct Hopper {
    std::uint32_t id;
    std::uint32_t left;
  };
  const auto a = graph.add_stage<Hopper>({.name = "a", .bins = 64, .rank = 1});
  const auto b = graph.add_stage<std::uint32_t>({.name = "b", .bins = 3, .rank = 2});
  graph.set_kernel(a, [&](const Batch<Hopper>& batch, Emitter& out) {
    for (const Hopper& item : batch.items) {
      if (item.left > 0) {
        out.emit(a, (item.id + item.left) % 64, Hopper{item.id, item.left - 1});
      } else {
        out.emit(b, item.id % 3, item.id);
      }
    }
    hops += batch.items.size();
  });
  std::atomic<std::uint64_t> sum{0};
  graph.set_kernel(b, [&](const Batch<std::uint32_t>& batch, Emitter&) {
    sum += std::accumulate(batch.items.begin(), batch.items.end(), std::uint64_t{0});
  });
  std::uint32_t next = 0;
  const auto source = graph.add_source({.name = "s"}, [&](SourceContext& ctx, Emitter& out) {
    for (std::uint32_t i = 0; i < ctx.budget && next < kCount; ++i, ++next) {
      out.emit(a, next % 64, Hopper{next, next % 10});
    }
    return next < kCount ? SourceStatus::more : SourceStatus::exhausted;
  });
  graph.add_edge(source, a);
  graph.add_edge(a, a);
  graph.add_edge(a, b);
  const auto report = carpool::run(graph, options());
  EXPECT_EQ(sum.load(), std::uint64_t{kCount} * (kCount - 1) / 2);
  EXPECT_EQ(hops.load(), std::uint64_t{kCount} / 10 * 55);
  EXPECT_EQ(report.stages[1].items, kCount);
}

TEST_P(BasicsTest, ManyItemsGoEachItsOwnWay) {
  constexpr std::uint32_t kCount = 50'000;
  std::vector<std::atomic<int>> seen(kCount);
  carpool::Graph graph;
  const auto sort = graph.add_stage<std::uint32_t>({.name = "sort"});
  const std::array sorted{graph.add_stage<std::uint32_t>({.name = "even", .bins = 5, .rank = 1}),
                          graph.add_stage<std::uint32_t>({.name = "odd", .bins = 700, .rank = 2})};
  const auto bins = std::array<std::uint32_t, 2>{5, 700};
  graph.set_kernel(sort, [&](const Batch<std::uint32_t>& batch, Emitter& out) {
    out.emit_each(batch.items, [&](std::uint32_t item) {
      return std::pair(sorted[item % 2], item % bins[item % 2]);
    });
  });
  for (const std::uint32_t odd : {0U, 1U}) {
    graph.set_kernel(sorted[odd], [&, odd](const Batch<std::uint32_t>& batch, Emitter&) {
      for (const std::uint32_t item : batch.items) {
        EXPECT_EQ(item % 2, odd);
        EXPECT_EQ(item % bins[odd], batch.bin);
        seen[item].fetch_add(1);
      }
    });
  }
  graph.add_source({.name = "numbers"}, counting_source(sort, kCount, 1));
  const carpool::RunReport report = carpool::run(graph, options());
  for (const auto& count : seen) {
    ASSERT_EQ(count.load(), 1);
  }
  EXPECT_LE(report.peak_bytes, report.worst_case_bytes);
}

INSTANTIATE_TEST_SUITE_P(
    Modes, BasicsTest,
    testing::Values(Setting{carpool::RunMode::serial, 0}, Setting{carpool::RunMode::threads, 1},
                    Setting{carpool::RunMode::threads, 2}, Setting{carpool::RunMode::threads, 8}),
    [](const auto& info) {
      return (info.param.mode == carpool::RunMode::serial ? "serial" : "threads") +
             std::to_string(info.param.threads);
    });

}  // namespace
