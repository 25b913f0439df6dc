// Keeping a trace within its bounds, and writing it in the Trace Event Format.
#include "trace_log.h"

#include <algorithm>
#include <stdexcept>

#include "carpool/trace.h"
#include "carpool/version.h"
#include "json.h"
#include "layout.h"

namespace carpool {

Trace::Trace(std::size_t max_bytes) : log_(std::make_shared<TraceLog>(max_bytes)) {}

void Trace::write(std::ostream& out) const {
  (log_ ? log_ : std::make_shared<TraceLog>(0))->write(out);
}

TraceSession::TraceSession(TraceLog* log, const Graph& graph, const Layout& layout,
                           const RunClock& clock)
    : log_(log), clock_(clock) {
  if (log_ != nullptr) {
    log_->begin(graph, layout, clock.is_virtual(), clock.ticks());
  }
}

TraceSession::~TraceSession() {
  if (log_ != nullptr) {
    log_->end(clock_.ticks(), clock_.seconds_per_tick());
  }
}

void TraceLane::limit(std::size_t bytes) {
  most_chunks_ = std::max<std::size_t>(2, bytes / sizeof(Chunk));
  while (chunks_.size() > most_chunks_) {
    chunks_.pop_front();
    dropped_ += kChunk;
  }
}

void TraceLane::next_chunk() {
  if (chunks_.size() < most_chunks_) {
    chunks_.push_back(std::make_unique<Chunk>());
  } else {
    chunks_.push_back(std::move(chunks_.front()));
    chunks_.pop_front();
    dropped_ += kChunk;
  }
  used_ = 0;
}

void TraceLog::begin(const Graph& graph, const Layout& layout, bool is_virtual,
                     std::uint64_t ticks) {
  const std::lock_guard guard(mutex_);
  if (running_ || (!names_.empty() && virtual_ != is_virtual)) {
    throw std::invalid_argument(
        running_ ? "carpool: a trace records one run at a time; give each run its own"
                 : "carpool: simulated and real runs cannot share a trace; give each its own");
  }
  std::vector<std::string> names;
  for (const auto& stage : graph.stages()) {
    names.push_back(stage.options.name);
  }
  for (const auto& source : graph.sources()) {
    names.push_back(source.options.name);
  }
  // The graph of the last run, as a rule.
  if (!std::equal(names.begin(), names.end(), names_.begin() + first_name_, names_.end())) {
    first_name_ = static_cast<std::uint32_t>(names_.size());
    names_.insert(names_.end(), names.begin(), names.end());
  }
  lane_names_.clear();
  for (std::uint32_t i = 0; i < layout.workers; ++i) {
    lane_names_.push_back("worker " + std::to_string(i));
  }
  for (std::size_t s = 0; s < layout.stages.size(); ++s) {
    for (std::uint32_t i = 0;
         layout.stages[s].blocking && i < graph.stages()[s].options.concurrency; ++i) {
      lane_names_.push_back(graph.stages()[s].options.name + " " + std::to_string(i));
    }
  }
  while (lanes_.size() < lane_names_.size()) {
    lanes_.push_back(std::make_unique<TraceLane>());
  }
  for (const auto& lane : lanes_) {
    lane->limit(max_bytes_ / lanes_.size());
  }
  // Real time goes on between runs, virtual time begins anew with each.
  const bool first = seconds_per_tick_ == 0;
  shift_ = first || is_virtual ? ticks - last_time_ : shift_;
  virtual_ = is_virtual;
  running_ = true;
}

void TraceLog::end(std::uint64_t ticks, double seconds_per_tick) {
  const std::lock_guard guard(mutex_);
  last_time_ = time(ticks);
  seconds_per_tick_ = seconds_per_tick;
  running_ = false;
}

void TraceLog::write(std::ostream& out) const {
  const std::lock_guard guard(mutex_);
  if (running_) {
    throw std::logic_error("carpool: a trace can be written when its run is over, not before");
  }
  std::uint64_t dropped = 0;
  for (const auto& lane : lanes_) {
    dropped += lane->dropped();
  }
  JsonObject json(out);
  json.text("displayTimeUnit", "ns");
  JsonObject about(json.name("otherData"));
  about.text("recorder", std::string("carpool ") + CARPOOL_VERSION);
  about.count("dropped_events", dropped);
  about.end();
  json.name("traceEvents") << "[\n"
                           << R"({"name":"process_name","ph":"M","pid":1,"tid":0,)"
                           << R"("args":{"name":"carpool"}})";
  for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
    // A lane of an earlier run, with more workers, has no other name.
    const std::string name =
        lane < lane_names_.size() ? lane_names_[lane] : "worker " + std::to_string(lane);
    out << ",\n"
        << R"({"name":"thread_name","ph":"M","pid":1,"tid":)" << lane << R"(,"args":{"name":)"
        << json_string(name) << "}},\n"
        << R"({"name":"thread_sort_index","ph":"M","pid":1,"tid":)" << lane
        << R"(,"args":{"sort_index":)" << lane << "}}";
    lanes_[lane]->for_each([&](const TraceEvent& event) {
      out << ",\n";
      write_event(out, lane, event);
    });
  }
  out << "\n]";
  json.end();
  out << '\n';
}

void TraceLog::write_event(std::ostream& out, std::size_t lane, const TraceEvent& event) const {
  using Kind = TraceEvent::Kind;
  constexpr const char* kTime = "%.3f";  // nanoseconds, in microseconds
  const auto node_name = [&] { return names_[event.node]; };
  JsonObject json(out);
  json.count("pid", 1);
  json.count("tid", lane);
  json.number("ts", microseconds(event.begin), kTime);
  const auto lasting = [&](const std::string& name, const char* category) {
    json.text("ph", "X");
    json.text("name", name);
    json.text("cat", category);
    json.number("dur", microseconds(event.end - event.begin), kTime);
  };
  const auto counter = [&](const std::string& name) {
    json.text("ph", "C");
    json.text("name", name);
  };
  const auto arguments = [&](auto write) {
    JsonObject args(json.name("args"));
    write(args);
    args.end();
  };
  switch (event.kind) {
    case Kind::batch:
      lasting(node_name(), "batch");
      arguments([&](JsonObject& args) {
        args.count("bin", event.bin);
        args.count("items", event.items);
        args.text("flushed", to_string(event.cause));
      });
      break;
    case Kind::source:
      lasting(node_name(), "source");
      arguments([&](JsonObject& args) { args.count("items", event.items); });
      break;
    case Kind::search:
      lasting("searching", "idle");
      break;
    case Kind::away:
      lasting("away", "idle");
      break;
    case Kind::steal:
      json.text("ph", "i");
      json.text("s", "t");
      json.text("name", "steal");
      json.text("cat", "steal");
      arguments([&](JsonObject& args) { args.count("from_worker", event.node); });
      break;
    case Kind::in_flight:
      counter("in flight");
      arguments([&](JsonObject& args) { args.count("credits", event.end); });
      break;
    case Kind::queues:
      counter("blocks of worker " + std::to_string(lane));
      arguments([&](JsonObject& args) {
        args.count("ready", event.items);
        args.count("open", event.bin);
      });
      break;
    case Kind::waiting:
      counter("waiting for " + node_name());
      arguments([&](JsonObject& args) { args.count("items", event.end); });
      break;
  }
  json.end();
}

}  // namespace carpool
