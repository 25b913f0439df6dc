// The smaller promises of the manual: order, alignment, causes, reports, refusals, no allocation.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <span>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "allocations.h"
#include "carpool/carpool.h"
#include "random_graph.h"

namespace {

using carpool::Batch;
using carpool::Emitter;
using carpool::FlushCause;
using carpool::SourceContext;
using carpool::SourceStatus;

carpool::RunOptions serial(carpool::Policy policy = carpool::Policy::deepest_first()) {
  return {.policy = std::move(policy), .mode = carpool::RunMode::serial};
}

std::uint64_t flushes(const carpool::StageReport& stage, FlushCause cause) {
  return stage.flushes_by_cause[static_cast<std::size_t>(cause)];
}

// Three stages with full and partial blocks; returns the order in which batches ran, as
// "stage:items".
std::string order_of(carpool::Policy policy) {
  carpool::Graph graph;
  std::string order;
  std::vector<carpool::StageHandle<int>> stages;
  for (int rank : {1, 3, 2}) {
    stages.push_back(graph.add_stage<int>(
        {.name = std::to_string(rank), .bins = 2, .block_items = 4, .rank = rank}));
  }
  for (std::size_t i = 0; i < stages.size(); ++i) {
    graph.set_kernel(stages[i], [&, i](const Batch<int>& batch, Emitter&) {
      order += (order.empty() ? "" : " ") + std::string(1, "abc"[i]) + ":" +
               std::to_string(batch.items.size());
    });
  }
  graph.add_source({.name = "once"}, [&](SourceContext&, Emitter& out) {
    const std::vector<int> items(6, 7);
    out.emit(stages[0], 0, std::span(items));           // a: a full block and two items
    out.emit(stages[1], 0, std::span(items).first(1));  // b: one item
    out.emit(stages[2], 1, std::span(items).first(5));  // c: a full block and one item
    return SourceStatus::exhausted;
  });
  carpool::run(graph, serial(std::move(policy)));
  return order;
}

TEST(PolicyTest, EachHasItsOrder) {
  // Blocks are published as they become full, which needs one more item: a:4 at the fifth item, c:4
  // likewise.
  EXPECT_EQ(order_of(carpool::Policy::deepest_first()), "c:4 a:4 a:2 b:1 c:1");
  EXPECT_EQ(order_of(carpool::Policy::oldest_first()), "a:4 c:4 a:2 b:1 c:1");
  EXPECT_EQ(order_of(carpool::Policy::custom(
                "stage", 3, [](const carpool::BlockInfo& block) { return block.stage; })),
            "a:4 c:4 a:2 b:1 c:1");
  EXPECT_EQ(order_of(carpool::Policy::custom(
                "reversed", 3, [](const carpool::BlockInfo& block) { return 2 - block.stage; })),
            "c:4 a:4 c:1 b:1 a:2");
}

TEST(PolicyTest, FullestFirstTakesTheLongestBatch) {
  carpool::Graph graph;
  const auto stage = graph.add_stage<int>({.name = "s", .bins = 4, .block_items = 256});
  std::vector<std::size_t> lengths;
  graph.set_kernel(
      stage, [&](const Batch<int>& batch, Emitter&) { lengths.push_back(batch.items.size()); });
  graph.add_source({.name = "once"}, [&](SourceContext&, Emitter& out) {
    const std::vector<int> items(100, 7);
    out.emit(stage, 0, std::span(items).first(1));
    out.emit(stage, 1, std::span(items).first(20));
    out.emit(stage, 2, std::span(items).first(100));
    out.emit(stage, 3, std::span(items).first(5));
    return SourceStatus::exhausted;
  });
  carpool::run(graph, serial(carpool::Policy::fullest_first()));
  EXPECT_EQ(lengths, (std::vector<std::size_t>{100, 20, 5, 1}));
}

// The bins in which batches ran, of a stage that was given some items for each of `bins` and whose
// kernel emits one more item, two bins on, for each batch until bin `last`.
std::vector<std::uint32_t> bins_of(carpool::Policy policy, const std::vector<std::uint32_t>& bins,
                                   std::uint32_t ring, std::uint32_t last) {
  carpool::Graph graph;
  const auto stage = graph.add_stage<std::uint32_t>({.name = "s", .bins = ring, .block_items = 4});
  std::vector<std::uint32_t> seen;
  graph.set_kernel(stage, [&](const Batch<std::uint32_t>& batch, Emitter& out) {
    seen.push_back(batch.items.front());
    if (seen.back() + 2 <= last) {
      out.emit(stage, (seen.back() + 2) % ring, seen.back() + 2);
    }
  });
  graph.add_source({.name = "once"}, [&](SourceContext&, Emitter& out) {
    for (std::size_t i = 0; i < bins.size(); ++i) {
      for (std::size_t k = 0; k < 1 + 4 * (i % 2); ++k) {  // every second one has a full block
        out.emit(stage, bins[i] % ring, bins[i]);
      }
    }
    return SourceStatus::exhausted;
  });
  carpool::run(graph, serial(std::move(policy)));
  return seen;
}

TEST(PolicyTest, BinsInOrderTakesTheLowestFullOrNot) {
  using Bins = std::vector<std::uint32_t>;
  // Bin 9 has a full block and one more item, bins 3 and 12 one item each.
  EXPECT_EQ(bins_of(carpool::Policy::bins_in_order(), {12, 9, 3}, 16, 0), (Bins{3, 9, 9, 12}));
  EXPECT_EQ(bins_of(carpool::Policy::bins_in_order(), {12, 9, 3}, 16, 8),
            (Bins{3, 5, 7, 9, 9, 12}));
}

TEST(PolicyTest, BinsInARingGoOnPastTheEnd) {
  // Two sequences that go three times round a ring of 8, the second a bin ahead; it begins with a
  // full block and one more item.
  std::vector<std::uint32_t> expected = {0, 1};
  for (std::uint32_t bin = 1; bin <= 24; ++bin) {
    expected.push_back(bin);
  }
  EXPECT_EQ(bins_of(carpool::Policy::bins_in_ring(), {0, 1}, 8, 24), expected);
}

TEST(PolicyTest, BadOnesAreRefused) {
  EXPECT_THROW(carpool::Policy::custom("x", 0, [](const carpool::BlockInfo&) { return 0U; }),
               std::invalid_argument);
  EXPECT_THROW(carpool::Policy::custom("x", 1, nullptr), std::invalid_argument);
}

TEST(SerialTest, IsTheSameEveryTime) {
  const auto once = [] {
    carpool_test::RandomGraph random({.seed = 5, .items = 5000, .fan_out = 3});
    const auto report = carpool::run(random.graph(), serial());
    std::vector<std::uint64_t> numbers;
    for (const auto& stage : report.stages) {
      numbers.push_back(stage.batches);
      for (const auto& bin : stage.bins) {
        numbers.push_back(bin.batches);
        numbers.push_back(bin.items);
      }
    }
    return numbers;
  };
  EXPECT_EQ(once(), once());
}

TEST(BatchTest, IsAlignedAndNeverLongerThanTheBlock) {
  struct Odd {
    std::uint8_t bytes[13];
  };
  carpool::Graph graph;
  const auto stage = graph.add_stage<Odd>({.name = "odd", .bins = 5, .block_items = 37});
  graph.set_kernel(stage, [&](const Batch<Odd>& batch, Emitter&) {
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(batch.items.data()) % 64, 0U);
    EXPECT_LE(batch.items.size(), 37U);
    for (const Odd& item : batch.items) {
      EXPECT_EQ(item.bytes[12], batch.bin);
    }
  });
  std::uint32_t next = 0;
  graph.add_source({.name = "s"}, [&](SourceContext& ctx, Emitter& out) {
    for (std::uint32_t i = 0; i < ctx.budget; ++i, ++next) {
      Odd odd{};
      odd.bytes[12] = static_cast<std::uint8_t>(next % 5);
      out.emit(stage, next % 5, odd);
    }
    return next < 5000 ? SourceStatus::more : SourceStatus::exhausted;
  });
  const auto report = carpool::run(graph, {.threads = 2});
  EXPECT_EQ(report.stages[0].items, next);
}

// One source call of `count` items to one bin.
carpool::RunReport run_of(std::uint32_t count, carpool::StageOptions stage_options,
                          carpool::RunOptions options) {
  carpool::Graph graph;
  const auto stage = graph.add_stage<std::uint32_t>(std::move(stage_options));
  graph.set_kernel(stage, [](const Batch<std::uint32_t>&, Emitter&) {});
  graph.add_source({.name = "s", .burst = 100'000}, [=](SourceContext&, Emitter& out) {
    for (std::uint32_t i = 0; i < count; ++i) {
      out.emit(stage, 0, i);
    }
    return SourceStatus::exhausted;
  });
  return carpool::run(graph, options);
}

TEST(ReportTest, CountsSeatsRunsAndCauses) {
  const auto report = run_of(250, {.name = "s", .block_items = 100, .lanes = 8}, serial());
  const auto& stage = report.stages[0];
  EXPECT_EQ(stage.batches, 3U);  // 100, 100, 50
  EXPECT_EQ(flushes(stage, FlushCause::full), 2U);
  EXPECT_EQ(flushes(stage, FlushCause::idle), 1U);
  EXPECT_DOUBLE_EQ(stage.run_length, 250.0 / 3);
  EXPECT_DOUBLE_EQ(stage.seats_filled, 250.0 / (104 + 104 + 56));
  EXPECT_EQ(stage.bins[0].items, 250U);
  EXPECT_EQ(report.sources[0].items, 250U);
  EXPECT_EQ(report.sources[0].calls, 1U);
  EXPECT_LE(report.kernel_seconds + report.source_seconds + report.scheduler_seconds,
            report.seconds * 1.01);
}

TEST(ReportTest, FlushByCount) {
  carpool::RunOptions options = serial();
  options.flush.count = 10;
  const auto report = run_of(95, {.name = "s", .block_items = 100}, options);
  EXPECT_EQ(report.stages[0].batches, 10U);
  EXPECT_EQ(flushes(report.stages[0], FlushCause::count), 9U);
}

// A stage that makes more of itself keeps the worker busy; the lone item leaves because of its age.
TEST(ReportTest, FlushByAge) {
  carpool::Graph graph;
  const auto busy = graph.add_stage<int>({.name = "busy", .block_items = 1, .rank = 5});
  const auto lone = graph.add_stage<int>({.name = "lone", .block_items = 8, .rank = 1});
  bool lone_ran = false;
  bool first = true;
  graph.set_kernel(busy, [&](const Batch<int>&, Emitter& out) {
    if (first) {
      out.emit(lone, 0, 1);
      first = false;
    }
    if (!lone_ran) {
      out.emit(busy, 0, 1);
      out.emit(busy, 0, 1);  // makes the first one full and published
    }
  });
  graph.set_kernel(lone, [&](const Batch<int>&, Emitter&) { lone_ran = true; });
  graph.add_source({.name = "s", .fan_out = 100'000, .burst = 10},
                   [&](SourceContext&, Emitter& out) {
                     out.emit(busy, 0, 1);
                     return SourceStatus::exhausted;
                   });
  carpool::RunOptions options{.in_flight = 10'000'000,
                              .policy = carpool::Policy::oldest_first(),
                              .flush = {.linger = std::chrono::microseconds(50)},
                              .mode = carpool::RunMode::serial};
  const auto report = carpool::run(graph, options);
  EXPECT_EQ(flushes(report.stages[1], FlushCause::linger), 1U);
}

TEST(ReportTest, PrintsAndWritesJson) {
  carpool_test::RandomGraph random({.seed = 2});
  const auto report = carpool::run(random.graph(), {.threads = 2});
  std::ostringstream text;
  report.print(text);
  EXPECT_NE(text.str().find("seats"), std::string::npos);
  const std::string json = report.to_json();
  EXPECT_EQ(std::count(json.begin(), json.end(), '{'), std::count(json.begin(), json.end(), '}'));
  EXPECT_EQ(std::count(json.begin(), json.end(), '['), std::count(json.begin(), json.end(), ']'));
  for (const char* key :
       {"\"stages\":", "\"bins\":", "\"workers\":", "\"peak_bytes\":", "\"flushes_by_cause\":"}) {
    EXPECT_NE(json.find(key), std::string::npos) << key;
  }
  EXPECT_LT(report.to_json(0).size(), json.size());
}

TEST(ReportTest, SaysWhenKeysAreTooMany) {
  carpool_test::RandomGraph random({.seed = 2, .stages = 1, .most_bins = 5000, .items = 20'000});
  const auto report = carpool::run(random.graph(), {.threads = 1, .in_flight = 100});
  ASSERT_FALSE(report.notes.empty());
  EXPECT_NE(report.notes[0].find("too many"), std::string::npos);
}

TEST(ReportTest, ProgressIsCalledAndItsExceptionsArrive) {
  carpool_test::RandomGraph random({.seed = 2, .items = 20'000});
  std::atomic<int> calls{0};
  carpool::RunOptions options{.threads = 3, .progress_every = std::chrono::milliseconds(0)};
  std::uint64_t last = 0;
  options.progress = [&](const carpool::Progress& progress) {
    ++calls;
    last = std::max(last, progress.item_visits);  // not atomic: calls do not overlap
  };
  const auto report = carpool::run(random.graph(), options);
  EXPECT_GT(calls.load(), 0);
  EXPECT_GT(last, 0U);
  EXPECT_LE(last, report.stages[0].items + report.stages[1].items + report.stages[2].items +
                      report.stages[3].items);

  carpool_test::RandomGraph again({.seed = 2, .items = 20'000});
  options.progress = [](const carpool::Progress&) { throw std::runtime_error("progress"); };
  EXPECT_THROW(carpool::run(again.graph(), options), std::runtime_error);
}

// One root may become all the items there may be. Its first children are published, and retire on
// another worker, while its kernel still emits; their credits must not admit a second root.
TEST(CreditsTest, ChildrenThatRetireBeforeTheirParentAdmitNothing) {
  carpool::Graph graph;
  const carpool::Monitor monitor;
  const auto split = graph.add_stage<int>({.name = "split", .block_items = 1});
  const auto leaf = graph.add_stage<int>({.name = "leaf", .block_items = 4});
  std::atomic<int> inside{0};
  std::atomic<int> leaf_batches{0};
  bool overlapped = false;
  graph.set_kernel(split, [&](const Batch<int>& batch, Emitter& out) {
    overlapped |= inside.fetch_add(1) != 0;
    if (batch.items[0] == 0) {
      for (int i = 0; i < 9; ++i) {
        out.emit(leaf, 0, i);  // eight of them in two full blocks, which somebody else takes
      }
      while (leaf_batches < 2) {
        std::this_thread::yield();
      }
      // They have retired. Whoever ran them now finds a source that may be called, or leaves.
      for (auto state = monitor.look(); state->active > 1 && inside == 1; state = monitor.look()) {
        std::this_thread::yield();
      }
    }
    inside.fetch_sub(1);
  });
  graph.set_kernel(leaf, [&](const Batch<int>&, Emitter&) { ++leaf_batches; });
  int roots = 0;
  graph.add_source({.name = "roots", .fan_out = 16, .burst = 1}, [&](SourceContext&, Emitter& out) {
    out.emit(split, 0, roots);
    return ++roots == 2 ? SourceStatus::exhausted : SourceStatus::more;
  });
  const auto report = carpool::run(graph, {.threads = 2, .in_flight = 16, .monitor = monitor});
  EXPECT_FALSE(overlapped);
  EXPECT_EQ(report.stages[0].items, 2U);
}

// A root that emits so many items, of so many credits each, that their sum needs more than 32 bits.
TEST(CreditsTest, OneCallMaySpendMoreThanFourBillion) {
  carpool::Graph graph;
  const auto split = graph.add_stage<int>({.name = "split", .block_items = 1});
  constexpr int kChildren = 65'536;  // each in a bin of its own, so that no block is published
  const auto leaf = graph.add_stage<int>({.name = "leaf", .bins = kChildren});
  int alive = 0;
  int most_alive = 0;
  graph.set_kernel(split, [&](const Batch<int>&, Emitter& out) {
    for (int i = 0; i < kChildren; ++i) {
      out.emit(leaf, static_cast<std::uint32_t>(i), i);
    }
    alive += kChildren;
    most_alive = std::max(most_alive, alive);
  });
  graph.set_kernel(leaf, [&](const Batch<int>& batch, Emitter&) {
    alive -= static_cast<int>(batch.items.size());
  });
  int roots = 0;
  graph.add_source({.name = "roots", .fan_out = 131'072}, [&](SourceContext&, Emitter& out) {
    out.emit(split, 0, 0);
    return ++roots == 3 ? SourceStatus::exhausted : SourceStatus::more;
  });
  carpool::run(graph, {.in_flight = 131'072, .mode = carpool::RunMode::serial});
  EXPECT_EQ(most_alive, kChildren);
  EXPECT_EQ(alive, 0);
}

TEST(AllocationTest, NoneInSteadyState) {
  if (!carpool_test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has replaced operator new";
  }
  const auto count = [](std::uint32_t items) {
    carpool_test::RandomGraph random({.seed = 4, .most_bins = 200, .items = items, .fan_out = 4});
    const std::uint64_t before = carpool_test::allocation_count();
    carpool::run(random.graph(), {.in_flight = 2000, .mode = carpool::RunMode::serial});
    return carpool_test::allocation_count() - before;
  };
  count(1000);  // whatever is set up once per process
  EXPECT_GT(count(1000), 0U);
  EXPECT_LE(count(400'000), count(40'000) + 8);  // a slab or two at most, for ten times the work
}

TEST(GraphTest, DrawsItself) {
  carpool_test::RandomGraph random({.seed = 2, .stages = 2});
  const std::string dot = random.graph().dot();
  EXPECT_EQ(dot.rfind("digraph", 0), 0U);
  EXPECT_NE(dot.find("stage0 -> stage1"), std::string::npos);
  EXPECT_NE(dot.find("source0 -> stage0"), std::string::npos);
}

TEST(GraphTest, RefusesWhatMakesNoSense) {
  carpool::Graph graph;
  EXPECT_THROW(graph.add_stage<int>({.name = "x", .bins = 0}), std::invalid_argument);
  EXPECT_THROW(graph.add_stage<int>({.name = "x", .block_items = 0}), std::invalid_argument);
  EXPECT_THROW(graph.add_source({.name = "x"}, nullptr), std::invalid_argument);
  EXPECT_THROW(carpool::run(graph), std::invalid_argument);  // nothing in it
  const auto stage = graph.add_stage<int>({.name = "lonely"});
  graph.add_source({.name = "s"}, [](SourceContext&, Emitter&) { return SourceStatus::exhausted; });
  try {
    carpool::run(graph);
    FAIL() << "a stage without kernel ran";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("lonely"), std::string::npos);
  }
  graph.set_kernel(stage, [](const Batch<int>&, Emitter&) {});
  EXPECT_EQ(carpool::run(graph).stages[0].items, 0U);
}

TEST(EmitterTest, RefusesBinsAndHandlesThatDoNotExist) {
  for (const bool use_default_handle : {false, true}) {
    carpool::Graph graph;
    const auto stage = graph.add_stage<int>({.name = "s", .bins = 3});
    graph.set_kernel(stage, [](const Batch<int>&, Emitter&) {});
    graph.add_source({.name = "s"}, [&](SourceContext&, Emitter& out) {
      if (use_default_handle) {
        out.emit(carpool::StageHandle<int>(), 0, 1);
      } else {
        out.emit(stage, 3, 1);
      }
      return SourceStatus::exhausted;
    });
    EXPECT_THROW(carpool::run(graph), std::out_of_range);
  }
}

// A kernel may go on after a refusal: what went before it is on its way, and counted.
TEST(EmitterTest, WhatWentBeforeABadBinHoldsItsCredits) {
  carpool::Graph graph;
  const auto stage = graph.add_stage<int>({.name = "s", .bins = 3});
  int items = 0;
  graph.set_kernel(stage, [&](const Batch<int>& batch, Emitter&) {
    items += static_cast<int>(batch.items.size());
  });
  graph.add_source({.name = "s"}, [&](SourceContext&, Emitter& out) {
    const std::vector numbers{0, 1, 2, 3, 1};
    const auto to = [&](int number) {
      return std::pair(stage, static_cast<std::uint32_t>(number));
    };
    EXPECT_THROW(out.emit_each(std::span(numbers), to), std::out_of_range);
    return SourceStatus::exhausted;
  });
  const carpool::RunReport report = carpool::run(graph, serial());
  EXPECT_EQ(items, 3);
  EXPECT_EQ(report.sources[0].items, 3U);
}

#ifndef NDEBUG
TEST(EmitterTest, RefusesUndeclaredEdges) {
  carpool::Graph graph;
  const auto a = graph.add_stage<int>({.name = "a"});
  const auto b = graph.add_stage<int>({.name = "b"});
  graph.set_kernel(a, [&](const Batch<int>&, Emitter& out) { out.emit(b, 0, 1); });
  graph.set_kernel(b, [](const Batch<int>&, Emitter&) {});
  graph.add_source({.name = "s"}, [&](SourceContext&, Emitter& out) {
    out.emit(a, 0, 1);
    return SourceStatus::exhausted;
  });
  EXPECT_EQ(carpool::run(graph).stages[1].items, 1U);  // nothing declared: nothing refused
  graph.add_edge(a, a);
  EXPECT_THROW(carpool::run(graph), std::logic_error);
  graph.add_edge(a, b);
  EXPECT_EQ(carpool::run(graph).stages[1].items, 1U);
}
#endif

}  // namespace
