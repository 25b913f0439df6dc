// Building a graph, and drawing it.
#include "carpool/graph.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "carpool/monitor.h"

namespace carpool {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("carpool: " + what);
}

constexpr std::uint64_t kMostSlots = 1ULL << 26;
constexpr std::uint32_t kMostBlockingThreads = 1024;

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      result += '\\';
    }
    result += c;
  }
  return result + '"';
}

std::string limits_of(const StageOptions& options) {
  if (options.concurrency == 0) {
    return "";
  }
  return std::string("\n")
      .append(std::to_string(options.concurrency))
      .append(options.blocking ? " threads of its own" : " at once");
}

}  // namespace

std::uint32_t Graph::add_raw_stage(StageOptions options, std::size_t item_bytes,
                                   std::size_t item_align) {
  if (options.name.empty()) {
    options.name = "stage " + std::to_string(stages_.size());
  }
  if (options.bins == 0 || options.block_items == 0 || options.lanes == 0) {
    refuse("stage '" + options.name + "': bins, block_items and lanes must not be zero");
  }
  if (options.blocking &&
      (options.concurrency == 0 || options.concurrency > kMostBlockingThreads)) {
    refuse("stage '" + options.name +
           "': a blocking stage has threads of its own; set concurrency to how many, at most 1024");
  }
  if (std::uint64_t{slots_} + options.bins > kMostSlots) {
    refuse("stage '" + options.name + "': more than 2^26 bins in one graph; use coarser keys");
  }
  const auto index = static_cast<std::uint32_t>(stages_.size());
  const std::uint32_t bins = options.bins;
  stages_.push_back({.options = std::move(options),
                     .item_bytes = item_bytes,
                     .item_align = item_align,
                     .first_slot = slots_,
                     .kernel = {},
                     .successors = {}});
  slots_ += bins;
  return index;
}

void Graph::set_raw_kernel(std::uint32_t stage, RawKernel kernel) {
  if (stage >= stages_.size()) {
    refuse("set_kernel for a stage of another graph");
  }
  stages_[stage].kernel = std::move(kernel);
}

SourceHandle Graph::add_source(SourceOptions options, SourceFunction function) {
  if (options.name.empty()) {
    options.name = "source " + std::to_string(sources_.size());
  }
  if (options.fan_out == 0 || options.burst == 0) {
    refuse("source '" + options.name + "': fan_out and burst must not be zero");
  }
  if (!function) {
    refuse("source '" + options.name + "' has no function");
  }
  sources_.push_back(
      {.options = std::move(options), .function = std::move(function), .successors = {}});
  return SourceHandle(static_cast<std::uint32_t>(sources_.size() - 1));
}

void Graph::add_stage_edge(std::uint32_t from, std::uint32_t to) {
  if (from >= stages_.size() || to >= stages_.size()) {
    refuse("add_edge for a stage of another graph");
  }
  auto& successors = stages_[from].successors;
  if (std::find(successors.begin(), successors.end(), to) == successors.end()) {
    successors.push_back(to);
  }
}

void Graph::add_source_edge(std::uint32_t from, std::uint32_t to) {
  if (from >= sources_.size() || to >= stages_.size()) {
    refuse("add_edge for a source or stage of another graph");
  }
  auto& successors = sources_[from].successors;
  if (std::find(successors.begin(), successors.end(), to) == successors.end()) {
    successors.push_back(to);
  }
}

void Graph::validate() const {
  if (stages_.empty() || sources_.empty()) {
    refuse("a graph needs at least one stage and one source");
  }
  for (const Stage& stage : stages_) {
    if (!stage.kernel) {
      refuse("stage '" + stage.options.name + "' has no kernel; call set_kernel");
    }
  }
}

std::string Graph::dot(const RunState* live) const {
  std::uint64_t queued = 1;
  for (std::size_t i = 0; live != nullptr && i < live->stages.size(); ++i) {
    queued += live->stages[i].queued;
  }
  std::ostringstream out;
  out << "digraph carpool {\n  rankdir=LR;\n  node [fontname=\"sans-serif\"];\n";
  const auto node = [&](const char* kind, std::size_t index, const std::string& shape,
                        const std::string& label, const std::vector<std::uint32_t>& successors) {
    out << "  " << kind << index << " [" << shape << ", label=" << quoted(label) << "];\n";
    for (const std::uint32_t to : successors) {
      out << "  " << kind << index << " -> stage" << to << ";\n";
    }
  };
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    const Source& source = sources_[i];
    std::string label = source.options.name + "\nfan-out " + std::to_string(source.options.fan_out);
    if (live != nullptr) {
      const RunState::Source& state = live->sources.at(i);
      label += '\n';
      label += state.exhausted ? "exhausted" : std::to_string(state.inside) + " inside";
    }
    node("source", i, "shape=house", label, source.successors);
  }
  for (std::size_t i = 0; i < stages_.size(); ++i) {
    const Stage& stage = stages_[i];
    std::string shape = "shape=box";
    std::string label = stage.options.name + "\n" + std::to_string(stage.options.bins) +
                        " bins of " + std::to_string(stage.item_bytes) + " B items" +
                        limits_of(stage.options);
    if (live != nullptr) {
      const RunState::Stage& state = live->stages.at(i);
      label += '\n';
      label += std::to_string(state.queued) + " queued, " + std::to_string(state.running) +
               " running, " + std::to_string(state.items) + " done";
      const double share = static_cast<double>(state.queued) / static_cast<double>(queued);
      shape += ", style=filled, fillcolor=\"0.09 " + std::to_string(share) + " 1.0\"";
    }
    node("stage", i, shape, label, stage.successors);
  }
  out << "}\n";
  return out.str();
}

}  // namespace carpool
