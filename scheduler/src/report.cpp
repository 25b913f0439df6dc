// Showing a report: tables for people, JSON for programs.
#include "carpool/report.h"

#include <cstdio>
#include <ostream>
#include <sstream>

#include "json.h"

namespace carpool {

const char* to_string(FlushCause cause) {
  switch (cause) {
    case FlushCause::full:
      return "full";
    case FlushCause::count:
      return "count";
    case FlushCause::linger:
      return "linger";
    case FlushCause::asked:
      return "asked";
    case FlushCause::idle:
      return "idle";
  }
  return "?";
}

const char* to_string(Outcome outcome) {
  switch (outcome) {
    case Outcome::completed:
      return "completed";
    case Outcome::drained:
      return "drained";
    case Outcome::cancelled:
      return "cancelled";
    case Outcome::deadline:
      return "deadline";
  }
  return "?";
}

namespace {

template <class... Args>
std::string format(const char* pattern, Args... args) {
  char line[512];
  std::snprintf(line, sizeof line, pattern, args...);
  return line;
}

unsigned long long wide(std::uint64_t value) {
  return value;
}

void write_stage(std::ostream& out, const StageReport& stage, std::size_t max_bins) {
  JsonObject json(out);
  json.text("name", stage.name);
  json.count("batches", stage.batches);
  json.count("items", stage.items);
  json.number("run_length", stage.run_length);
  json.number("seats_filled", stage.seats_filled);
  json.count("steals", stage.steals);
  json.number("kernel_seconds", stage.kernel_seconds);
  JsonObject causes(json.name("flushes_by_cause"));
  for (std::size_t c = 0; c < kFlushCauses; ++c) {
    causes.count(to_string(static_cast<FlushCause>(c)), stage.flushes_by_cause[c]);
  }
  causes.end();
  if (stage.bins.size() <= max_bins) {
    write_json_list(json.name("bins"), stage.bins, [&](const BinReport& bin) {
      JsonObject entry(out);
      entry.count("batches", bin.batches);
      entry.count("items", bin.items);
      entry.end();
    });
  }
  json.end();
}

void write_source(std::ostream& out, const SourceReport& source) {
  JsonObject json(out);
  json.text("name", source.name);
  json.count("calls", source.calls);
  json.count("items", source.items);
  json.number("seconds", source.seconds);
  json.end();
}

void write_worker(std::ostream& out, const WorkerReport& worker) {
  JsonObject json(out);
  json.count("batches", worker.batches);
  json.count("items", worker.items);
  json.count("steals", worker.steals);
  json.count("arrivals", worker.arrivals);
  json.number("kernel_seconds", worker.kernel_seconds);
  json.number("source_seconds", worker.source_seconds);
  json.number("scheduler_seconds", worker.scheduler_seconds);
  json.number("search_seconds", worker.search_seconds);
  json.end();
}

}  // namespace

void RunReport::print(std::ostream& out) const {
  out << format("run %s in %.3f s, policy %s, %zu workers\n", to_string(outcome), seconds,
                policy.c_str(), workers.size());
  out << format("  %-16s %12s %12s %8s %7s %9s %9s  full/count/linger/asked/idle\n", "stage",
                "items", "batches", "run len", "seats", "steals", "kernel s");
  for (const StageReport& stage : stages) {
    out << format("  %-16.16s %12llu %12llu %8.1f %6.1f%% %9llu %9.3f  %llu/%llu/%llu/%llu/%llu\n",
                  stage.name.c_str(), wide(stage.items), wide(stage.batches), stage.run_length,
                  100 * stage.seats_filled, wide(stage.steals), stage.kernel_seconds,
                  wide(stage.flushes_by_cause[0]), wide(stage.flushes_by_cause[1]),
                  wide(stage.flushes_by_cause[2]), wide(stage.flushes_by_cause[3]),
                  wide(stage.flushes_by_cause[4]));
  }
  for (const SourceReport& source : sources) {
    out << format("  %-16.16s %12llu %12llu calls %29s %9.3f\n", source.name.c_str(),
                  wide(source.items), wide(source.calls), "", source.seconds);
  }
  const double all = seconds * static_cast<double>(workers.size());
  const double percent = all > 0 ? 100 / all : 0;
  out << format("  worker time: kernels %.1f%%, sources %.1f%%, scheduler %.1f%%, idle %.1f%%\n",
                kernel_seconds * percent, source_seconds * percent, scheduler_seconds * percent,
                idle_seconds * percent);
  if (!blocking_threads.empty()) {
    const double every = seconds * static_cast<double>(blocking_threads.size());
    out << format("  blocking stages: %zu threads, %.1f%% of the time in kernels\n",
                  blocking_threads.size(), every > 0 ? 100 * blocking_seconds / every : 0.0);
  }
  out << format("  memory: %.1f KiB of at most %.1f KiB; in flight: at most %llu of %llu\n",
                static_cast<double>(peak_bytes) / 1024,
                static_cast<double>(worst_case_bytes) / 1024, wide(peak_in_flight),
                wide(in_flight_limit));
  if (spilled_blocks != 0) {
    out << format("  spilled: %llu blocks, at most %.1f MiB in the file at once\n",
                  wide(spilled_blocks), static_cast<double>(peak_spill_bytes) / 1048576);
  }
  if (dropped_items != 0) {
    out << format("  dropped: %llu items\n", wide(dropped_items));
  }
  for (const std::string& note : notes) {
    out << "  note: " << note << '\n';
  }
}

std::string RunReport::to_json(std::size_t max_bins) const {
  std::ostringstream out;
  JsonObject json(out);
  json.text("outcome", to_string(outcome));
  json.text("policy", policy);
  json.number("seconds", seconds);
  json.number("kernel_seconds", kernel_seconds);
  json.number("source_seconds", source_seconds);
  json.number("scheduler_seconds", scheduler_seconds);
  json.number("idle_seconds", idle_seconds);
  json.number("blocking_seconds", blocking_seconds);
  json.count("peak_bytes", peak_bytes);
  json.count("worst_case_bytes", worst_case_bytes);
  json.count("peak_in_flight", peak_in_flight);
  json.count("in_flight_limit", in_flight_limit);
  json.count("overflow_blocks", overflow_blocks);
  json.count("spilled_blocks", spilled_blocks);
  json.count("peak_spill_bytes", peak_spill_bytes);
  json.count("dropped_items", dropped_items);
  write_json_list(json.name("stages"), stages,
                  [&](const StageReport& stage) { write_stage(out, stage, max_bins); });
  write_json_list(json.name("sources"), sources,
                  [&](const SourceReport& source) { write_source(out, source); });
  write_json_list(json.name("workers"), workers,
                  [&](const WorkerReport& worker) { write_worker(out, worker); });
  write_json_list(json.name("blocking_threads"), blocking_threads,
                  [&](const WorkerReport& thread) { write_worker(out, thread); });
  write_json_list(json.name("notes"), notes,
                  [&](const std::string& note) { out << json_string(note); });
  json.end();
  return out.str();
}

}  // namespace carpool
