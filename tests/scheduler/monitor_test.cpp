// What a monitor shows of a run that is under way.
#include "carpool/monitor.h"

#include <gtest/gtest.h>

#include <atomic>
#include <sstream>
#include <thread>

#include "carpool/carpool.h"
#include "random_graph.h"

namespace {

using carpool::Batch;
using carpool::Emitter;

TEST(MonitorTest, ShowsNothingBeforeAndAfterARun) {
  carpool::Monitor monitor;
  EXPECT_FALSE(monitor.look());
  carpool_test::RandomGraph random({.seed = 1});
  carpool::run(random.graph(), {.threads = 2, .monitor = monitor});
  EXPECT_FALSE(monitor.look());
  EXPECT_FALSE(carpool::Monitor(nullptr).look());
}

// A kernel that looks at its own run knows what must be seen.
TEST(MonitorTest, ShowsWorkersQueuesAndSources) {
  carpool::Graph graph;
  const carpool::Monitor monitor;
  const auto first = graph.add_stage<int>({.name = "first"});
  const auto second = graph.add_stage<int>({.name = "second", .bins = 5, .block_items = 2});
  std::optional<carpool::RunState> seen;
  graph.set_kernel(first, [&](const Batch<int>&, Emitter& out) {
    for (int i = 0; i < 7; ++i) {
      out.emit(second, 0, i);  // three full blocks, of which the last still open, and one item
    }
    out.emit(second, 1, 7);
    seen = monitor.look();
  });
  graph.set_kernel(second, [](const Batch<int>&, Emitter&) {});
  graph.add_source({.name = "one", .fan_out = 10}, [&](carpool::SourceContext&, Emitter& out) {
    out.emit(first, 0, 0);
    return carpool::SourceStatus::exhausted;
  });
  carpool::run(graph, {.in_flight = 100, .mode = carpool::RunMode::serial, .monitor = monitor});
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->active, 1U);
  EXPECT_FALSE(seen->stopped);
  EXPECT_FALSE(seen->over);
  ASSERT_EQ(seen->workers.size(), 1U);
  EXPECT_EQ(seen->workers[0].doing, "in stage first");
  EXPECT_EQ(seen->workers[0].ready_blocks, 3U);
  EXPECT_EQ(seen->workers[0].open_blocks, 2U);
  EXPECT_EQ(seen->workers[0].batches, 0U);
  ASSERT_EQ(seen->sources.size(), 1U);
  EXPECT_TRUE(seen->sources[0].exhausted);
  EXPECT_EQ(seen->sources[0].inside, 0U);
  std::ostringstream text;
  seen->print(text);
  EXPECT_NE(text.str().find("worker 0: in stage first; 3 ready blocks"), std::string::npos)
      << text.str();
}

// A drawing made in the middle of a run, by a kernel that has just emitted nine items.
TEST(MonitorTest, DotShowsWhatIsQueuedRunningAndDone) {
  const carpool::Monitor monitor;
  carpool::Graph graph;
  const auto first = graph.add_stage<int>({.name = "first"});
  const auto second = graph.add_stage<int>({.name = "second", .block_items = 4, .concurrency = 1});
  std::string drawing;
  graph.set_kernel(first, [&](const carpool::Batch<int>&, carpool::Emitter& out) {
    for (int i = 0; i < 9; ++i) {
      out.emit(second, 0, i);
    }
    drawing = graph.dot(monitor.look().value());
  });
  graph.set_kernel(second, [](const carpool::Batch<int>&, carpool::Emitter&) {});
  const auto source = graph.add_source({.name = "one"}, [&](auto&, carpool::Emitter& out) {
    out.emit(first, 0, 0);
    return carpool::SourceStatus::exhausted;
  });
  graph.add_edge(source, first);
  graph.add_edge(first, second);
  carpool::run(graph, {.mode = carpool::RunMode::serial, .monitor = monitor});
  EXPECT_NE(drawing.find("1 queued, 1 running, 0 done"), std::string::npos) << drawing;
  EXPECT_NE(drawing.find("8 queued, 0 running, 0 done"), std::string::npos) << drawing;
  EXPECT_NE(drawing.find("1 at once"), std::string::npos) << drawing;
  EXPECT_NE(drawing.find("exhausted"), std::string::npos) << drawing;
  EXPECT_NE(drawing.find("stage0 -> stage1"), std::string::npos) << drawing;
}

// Looking all the time from another thread disturbs nobody.
TEST(MonitorTest, MayLookAtAnyTime) {
  const carpool::Monitor monitor;
  std::atomic<bool> done{false};
  std::uint64_t most_items = 0;
  std::thread watcher([&] {
    while (!done) {
      if (const auto state = monitor.look()) {
        std::uint64_t items = 0;
        for (const auto& worker : state->workers) {
          items += worker.items;
        }
        most_items = std::max(most_items, items);
      }
    }
  });
  std::uint64_t visits = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    carpool_test::RandomGraph random({.seed = seed, .items = 3000});
    carpool::run(random.graph(), {.threads = 4, .in_flight = 500, .monitor = monitor});
    EXPECT_EQ(random.counted(), random.expected());
    visits = std::max(visits, random.expected().visits);
  }
  done = true;
  watcher.join();
  EXPECT_LE(most_items, visits);
}

}  // namespace
