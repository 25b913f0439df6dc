// The wavefront as arrays with barriers: all paths in flight take one step, wait for each other,
// and are sorted by what they do next.
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>
#include <vector>

#include "stages/executors/busy_clock.h"
#include "stages/executors/camera_group.h"
#include "stages/executors/ladder.h"
#include "stages/simd/denormals.h"
#include "stages/tables/huge_pages.h"

namespace carpool::stages {
namespace {

/// What a path does next; `idle` is a slot without a path.
enum Step : uint8_t { kIdle, kTrace, kShade, kMiss, kShadow, kFilm };
constexpr size_t kSteps = 6;
constexpr size_t kChunk = 256;  // slots of one piece of parallel work
constexpr size_t kMaxPaths = 65536;

size_t Capacity(const ExecutorOptions& options) {
  const size_t fitting = options.memory_bytes / 4 * 3 / sizeof(PathState);
  return std::clamp<size_t>(fitting, 1024, kMaxPaths) / 8 * 8;
}

class Barriers final : public Executor {
 public:
  Barriers(const KernelContext& context, const Kernels& kernels, const ExecutorOptions& options)
      : c_(context),
        kernels_(kernels.one),
        camera_(kernels.wide.camera),
        lanes_(kernels.wide.lanes),
        opacity_{&context, kernels.opacity},
        options_(options),
        paths_(Capacity(options)),
        step_(paths_.size()) {}

  std::string_view name() const override { return "barriers"; }
  std::string Dot() const override { return {}; }
  PassReport Render(const CameraPass& pass, const std::atomic<bool>& stop,
                    const std::function<void(double)>& progress) override;

 private:
  using Slots = std::span<const uint32_t>;

  void Start(CameraWork& work);
  void StartPacket(const CameraPacket& packet, const uint32_t* slots, RayCounts& rays);
  void Advance(Step step);
  void TakeStep(Step step, Slots slots, RayCounts& rays);
  void Shade(Slots slots);
  void Distribute(std::vector<uint32_t>& slots);
  Step AfterTrace(const PathState& path) const { return path.placement >= 0 ? kShade : kMiss; }

  /// Runs body(first, last) over chunks of [0, count) in parallel, and waits for all.
  template <class Body>
  void InParallel(size_t count, const Body& body) {
    tbb::parallel_for(size_t{0}, (count + kChunk - 1) / kChunk, [&](size_t chunk) {
      const FlushDenormals denormals;
      const BusyClock::Scope busy(*clock_);
      body(chunk * kChunk, std::min(count, (chunk + 1) * kChunk));
    });
  }

  const KernelContext& c_;
  KernelSet kernels_;
  CameraKernel camera_;
  int lanes_;
  OpacityQuery opacity_;
  ExecutorOptions options_;
  UnsetHugeVector<PathState> paths_;
  std::vector<Step> step_;  // of each slot, written by the step before
  std::array<std::vector<uint32_t>, kSteps> lists_;

  // Of the pass under way.
  tbb::enumerable_thread_specific<RayCounts> tallies_;
  BusyClock* clock_ = nullptr;
  bool more_packets_ = false;
  uint64_t shaded_ = 0, shade_calls_ = 0;
};

/// Appends each slot to the list of its next step, in order: counts per chunk, then places.
void Barriers::Distribute(std::vector<uint32_t>& slots) {
  const size_t chunks = (slots.size() + kChunk - 1) / kChunk;
  std::vector<std::array<uint32_t, kSteps>> places(chunks);
  InParallel(slots.size(), [&](size_t first, size_t last) {
    std::array<uint32_t, kSteps> count = {};
    for (size_t i = first; i < last; ++i) ++count[step_[slots[i]]];
    places[first / kChunk] = count;
  });
  std::array<uint32_t, kSteps> ends;
  for (size_t s = 0; s < kSteps; ++s) ends[s] = static_cast<uint32_t>(lists_[s].size());
  for (auto& place : places) {
    for (size_t s = 0; s < kSteps; ++s) ends[s] += std::exchange(place[s], ends[s]);
  }
  for (size_t s = 0; s < kSteps; ++s) lists_[s].resize(ends[s]);
  InParallel(slots.size(), [&](size_t first, size_t last) {
    std::array<uint32_t, kSteps>& place = places[first / kChunk];
    for (size_t i = first; i < last; ++i) {
      const Step step = step_[slots[i]];
      lists_[step][place[step]++] = slots[i];
    }
  });
  slots.clear();
}

void Barriers::StartPacket(const CameraPacket& packet, const uint32_t* slots, RayCounts& rays) {
  const CameraGroup group = TraceCameraGroup(c_, camera_, packet);
  for (size_t i = 0; i < 8; ++i) step_[slots[i]] = kIdle;
  for (uint32_t i = 0; i < group.count; ++i) {
    paths_[slots[i]] = group.paths[i];
    step_[slots[i]] = AfterTrace(paths_[slots[i]]);
  }
  rays.camera += group.count;
}

/// Fills idle slots with new camera paths.
void Barriers::Start(CameraWork& work) {
  std::vector<uint32_t> idle = std::move(lists_[kIdle]);
  lists_[kIdle].clear();
  std::vector<CameraPacket> packets;
  while (more_packets_ && (packets.size() + 1) * 8 <= idle.size()) {
    more_packets_ = work.Claim(0, 1, [&](const CameraPacket& p) { packets.push_back(p); });
  }
  for (size_t i = packets.size() * 8; i < idle.size(); ++i) step_[idle[i]] = kIdle;
  tbb::parallel_for(size_t{0}, packets.size(), [&](size_t p) {
    const FlushDenormals denormals;
    const BusyClock::Scope busy(*clock_);
    StartPacket(packets[p], &idle[p * 8], tallies_.local());
  });
  Distribute(idle);
}

void Barriers::Shade(Slots slots) {
  std::array<Next, kChunk> next;
  kernels_.shade(c_, paths_.data(), slots, next.data());
  for (size_t i = 0; i < slots.size(); ++i) {
    step_[slots[i]] = next[i] == Next::shadow ? kShadow : next[i] == Next::trace ? kTrace : kFilm;
  }
}

void Barriers::TakeStep(Step step, Slots slots, RayCounts& rays) {
  switch (step) {
    case kTrace:
      for (const uint32_t slot : slots) {
        IntersectPath(c_.trace, paths_[slot]);
        step_[slot] = AfterTrace(paths_[slot]);
      }
      rays.bounce += slots.size();
      break;
    case kShade:
      Shade(slots);
      break;
    case kMiss:
      kernels_.miss(c_, paths_.data(), slots);
      for (const uint32_t slot : slots) step_[slot] = kFilm;
      break;
    case kShadow:
      for (const uint32_t slot : slots) {
        TraceShadow(c_.trace, opacity_, paths_[slot]);
        step_[slot] = (paths_[slot].flags & kPathAlive) != 0 ? kTrace : kFilm;
      }
      rays.shadow += slots.size();
      break;
    case kFilm:
      for (const uint32_t slot : slots) {
        const PathState& path = paths_[slot];
        c_.film->Add(path.pixel, path.sample, path.radiance);
        step_[slot] = kIdle;
      }
      break;
    case kIdle:
      break;
  }
}

/// All paths of one list take their step; the barrier is its end.
void Barriers::Advance(Step step) {
  std::vector<uint32_t> slots = std::move(lists_[step]);
  lists_[step].clear();
  InParallel(slots.size(), [&](size_t first, size_t last) {
    TakeStep(step, {slots.data() + first, last - first}, tallies_.local());
  });
  if (step == kShade) {
    shaded_ += slots.size();
    shade_calls_ += (slots.size() + kChunk - 1) / kChunk;
  }
  Distribute(slots);
}

PassReport Barriers::Render(const CameraPass& pass, const std::atomic<bool>& stop,
                            const std::function<void(double)>& progress) {
  const auto begin = std::chrono::steady_clock::now();
  CameraWork work(c_.width, c_.height, pass);
  BusyClock clock(options_.threads);
  clock_ = &clock;
  tallies_.clear();
  shaded_ = shade_calls_ = 0;
  more_packets_ = true;
  for (auto& list : lists_) list.clear();
  for (uint32_t slot = 0; slot < paths_.size(); ++slot) lists_[kIdle].push_back(slot);

  const auto in_flight = [&] { return lists_[kIdle].size() < paths_.size(); };
  options_.arena->execute([&] {
    while (in_flight() || (more_packets_ && !stop.load(std::memory_order_relaxed))) {
      if (!stop.load(std::memory_order_relaxed)) Start(work);
      for (const Step step : {kTrace, kShade, kMiss, kShadow, kFilm}) Advance(step);
      if (progress) progress(work.Fraction());
    }
  });

  PassReport report;
  for (const RayCounts& rays : tallies_) report.rays += rays;
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  report.stopped = more_packets_;
  report.state_bytes = paths_.size() * (sizeof(PathState) + sizeof(Step) + sizeof(uint32_t));
  report.run_length =
      shade_calls_ > 0 ? static_cast<double>(shaded_) / static_cast<double>(shade_calls_) : 0;
  report.seats_filled = 1.0 / lanes_;
  report.idle_seconds = clock.Idle(report.seconds);
  clock_ = nullptr;
  return report;
}

}  // namespace

std::unique_ptr<Executor> MakeBarriers(const KernelContext& context, const Kernels& kernels,
                                       const ExecutorOptions& options) {
  return std::make_unique<Barriers>(context, kernels, options);
}

}  // namespace carpool::stages
