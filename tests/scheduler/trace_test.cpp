// Traces: the Trace Event Format, one track per worker, bounded memory, nothing without one.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "carpool/carpool.h"
#include "random_graph.h"

namespace {

using carpool_test::RandomGraph;
using nlohmann::json;

json written(const carpool::Trace& trace) {
  std::ostringstream text;
  trace.write(text);
  return json::parse(text.str());  // throws where it is no JSON
}

std::vector<json> of_phase(const json& trace, const std::string& phase) {
  std::vector<json> events;
  for (const json& event : trace.at("traceEvents")) {
    if (event.at("ph") == phase) {
      events.push_back(event);
    }
  }
  return events;
}

// What https://docs.google.com/document/d/1CvAClvFfyA5R-PhYUmn5OOQtYMH4h6I0nSsKchNAySU asks of
// each phase that we use.
void check_format(const json& trace) {
  ASSERT_TRUE(trace.is_object());
  ASSERT_TRUE(trace.at("displayTimeUnit") == "ns" || trace.at("displayTimeUnit") == "ms");
  for (const json& event : trace.at("traceEvents")) {
    SCOPED_TRACE(event.dump());
    ASSERT_TRUE(event.at("pid").is_number_integer());
    ASSERT_TRUE(event.at("tid").is_number_integer());
    ASSERT_TRUE(event.at("name").is_string());
    const std::string phase = event.at("ph");
    ASSERT_TRUE(std::string("XCiM").find(phase) != std::string::npos);
    if (phase == "M") {
      ASSERT_TRUE(event.at("args").is_object());
      continue;
    }
    ASSERT_GE(event.at("ts").get<double>(), 0.0);
    if (phase == "X") {
      ASSERT_GE(event.at("dur").get<double>(), 0.0);
    }
    if (phase == "C") {
      ASSERT_FALSE(event.at("args").empty());
      for (const json& value : event.at("args")) {
        ASSERT_TRUE(value.is_number());
      }
    }
    if (phase == "i") {
      ASSERT_EQ(event.at("s"), "t");
    }
  }
}

carpool::RunOptions traced(const carpool::Trace& trace, std::uint32_t threads) {
  return {.threads = threads, .in_flight = 500, .trace = trace};
}

class TraceTest : public testing::TestWithParam<std::uint32_t> {};

TEST_P(TraceTest, HasEveryBatchAndEveryCallOfASource) {
  RandomGraph random(
      {.seed = 4, .items = 3000, .fan_out = 2, .uneven = true, .caps = true, .blocking = true});
  const carpool::Trace trace;
  const auto report = carpool::run(random.graph(), traced(trace, GetParam()));
  const json record = written(trace);
  check_format(record);
  EXPECT_EQ(record.at("otherData").at("dropped_events"), 0);
  std::map<std::string, std::uint64_t> batches;
  std::map<std::string, std::uint64_t> items;
  std::uint64_t source_items = 0;
  for (const json& event : of_phase(record, "X")) {
    if (event.at("cat") == "batch") {
      ++batches[event.at("name")];
      items[event.at("name")] += event.at("args").at("items").get<std::uint64_t>();
    } else if (event.at("cat") == "source") {
      source_items += event.at("args").at("items").get<std::uint64_t>();
    }
  }
  for (const auto& stage : report.stages) {
    EXPECT_EQ(batches[stage.name], stage.batches) << stage.name;
    EXPECT_EQ(items[stage.name], stage.items) << stage.name;
  }
  EXPECT_EQ(source_items, report.sources[0].items);
  EXPECT_FALSE(of_phase(record, "C").empty());
}

// What lasts on one track does not overlap: a viewer would draw nonsense.
TEST_P(TraceTest, TracksDoNotOverlap) {
  RandomGraph random({.seed = 6, .items = 3000, .uneven = true, .blocking = true});
  const carpool::Trace trace;
  carpool::run(random.graph(), traced(trace, GetParam()));
  std::map<int, std::vector<std::pair<double, double>>> tracks;
  for (const json& event : of_phase(written(trace), "X")) {
    const double begin = event.at("ts");
    tracks[event.at("tid")].emplace_back(begin, begin + event.at("dur").get<double>());
  }
  for (auto& [track, spans] : tracks) {
    std::sort(spans.begin(), spans.end());
    for (std::size_t i = 1; i < spans.size(); ++i) {
      ASSERT_GE(spans[i].first, spans[i - 1].second - 0.002) << "track " << track;  // rounding
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Threads, TraceTest, testing::Values(1, 2, 8));

TEST(TraceTest, TracksAreNamed) {
  RandomGraph random({.seed = 1, .items = 100, .blocking = true});
  const carpool::Trace trace;
  const auto report = carpool::run(random.graph(), traced(trace, 3));
  std::set<std::string> names;
  for (const json& event : of_phase(written(trace), "M")) {
    if (event.at("name") == "thread_name") {
      names.insert(event.at("args").at("name"));
    }
  }
  EXPECT_EQ(names.size(), 3 + report.blocking_threads.size());
  EXPECT_TRUE(names.contains("worker 2"));
}

TEST(TraceTest, SimulatedRunsHaveTheSameTraceForTheSameSeed) {
  const auto once = [](std::uint64_t seed) {
    RandomGraph random({.seed = 2, .items = 1000, .caps = true, .blocking = true});
    const carpool::Trace trace;
    carpool::RunOptions options = traced(trace, 5);
    options.mode = carpool::RunMode::simulated;
    options.simulation.seed = seed;
    carpool::run(random.graph(), options);
    const json record = written(trace);
    check_format(record);
    return record.dump();
  };
  EXPECT_EQ(once(3), once(3));
  EXPECT_NE(once(3), once(4));
}

// Bounded: the last events stay, and the record says how many went.
TEST(TraceTest, MemoryIsBounded) {
  RandomGraph random({.seed = 3, .block_items = 1, .items = 20'000});
  const carpool::Trace trace(100'000);
  const auto report = carpool::run(random.graph(), traced(trace, 2));
  const json record = written(trace);
  std::uint64_t batches = 0;
  for (const auto& stage : report.stages) {
    batches += stage.batches;
  }
  const auto kept = record.at("traceEvents").size();
  EXPECT_LE(kept * 32, 100'000U + 32 * 8);  // an event takes 32 bytes; the names are few
  EXPECT_GT(record.at("otherData").at("dropped_events").get<std::uint64_t>() + kept, batches);
}

TEST(TraceTest, RunsFollowEachOther) {
  const carpool::Trace trace;
  double end_of_first = 0;
  for (int run = 0; run < 2; ++run) {
    RandomGraph random({.seed = 1, .stages = 1 + static_cast<std::uint32_t>(run), .items = 200});
    carpool::run(random.graph(), traced(trace, 2));
    double last = 0;
    for (const json& event : of_phase(written(trace), "X")) {
      last = std::max(last, event.at("ts").get<double>());
    }
    EXPECT_GT(last, end_of_first);
    end_of_first = last;
  }
}

// A run inside another cannot write to the same tracks, and nobody may read what is being written.
TEST(TraceTest, OneRunAtATime) {
  const carpool::Trace trace;
  const auto run_with = [&](std::function<void()> on_batch) {
    RandomGraph outer({.seed = 1, .items = 10});
    outer.on_batch = std::move(on_batch);
    carpool::run(outer.graph(), traced(trace, 1));
  };
  EXPECT_THROW(run_with([&] {
                 RandomGraph inner({.seed = 1, .items = 10});
                 carpool::run(inner.graph(), traced(trace, 1));
               }),
               std::invalid_argument);
  EXPECT_THROW(run_with([&] { written(trace); }), std::logic_error);
  EXPECT_NO_THROW(run_with(nullptr));
}

TEST(TraceTest, NoneRecordsNothing) {
  EXPECT_EQ(of_phase(written(carpool::Trace(nullptr)), "X").size(), 0U);
}

}  // namespace
