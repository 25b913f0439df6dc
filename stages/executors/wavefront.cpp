// The wavefront executor: the path tracer as a graph of stages, with queues binned by material and
// depth.
#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

#include "stages/executors/binning.h"
#include "stages/executors/camera_group.h"
#include "stages/executors/executor.h"
#include "stages/executors/partition.h"
#include "stages/executors/slot_pool.h"
#include "stages/simd/denormals.h"
#include "stages/tables/huge_pages.h"

namespace carpool::stages {
namespace {

using Slot = uint32_t;
constexpr uint32_t kMaxBatch = 65536;
// So many packets, and paths, of a batch at a time: what one step leaves of them is in the
// first-level cache for the next.
constexpr size_t kPathsAtOnce = CameraRays::kMost;
constexpr size_t kPacketsAtOnce = kPathsAtOnce / kCameraGroup;

struct alignas(64) WorkerTally {
  RayCounts rays;
};

/// Calls `visit` with a few slots after another.
template <class Visit>
void EachFew(std::span<const Slot> slots, const Visit& visit) {
  for (size_t i = 0; i < slots.size(); i += kPathsAtOnce)
    visit(slots.subspan(i, std::min(kPathsAtOnce, slots.size() - i)));
}

uint32_t BlockItems(const ExecutorOptions& options, uint32_t preferred) {
  return options.batch_items != 0 ? std::min(options.batch_items, kMaxBatch) : preferred;
}

/// Paths in flight: enough to fill the bins, few enough for the cache and the memory asked for. A
/// quarter of the budget is left to the queues.
uint32_t PathsThatFit(const ExecutorOptions& options) {
  const uint64_t fitting = options.memory_bytes / 4 * 3 / sizeof(PathState);
  return static_cast<uint32_t>(std::clamp<uint64_t>(fitting, 1024, 65536));
}

/// The material of each placement, or none but the first where bins are not wanted.
std::vector<int32_t> Materials(std::span<const Placement> placements, bool bins) {
  std::vector<int32_t> materials;
  for (const Placement& placement : placements) materials.push_back(bins ? placement.material : 0);
  return materials;
}

uint32_t MaterialCount(const std::vector<int32_t>& materials) {
  return materials.empty()
             ? 1
             : static_cast<uint32_t>(*std::max_element(materials.begin(), materials.end())) + 1;
}

class Wavefront final : public Executor {
 public:
  Wavefront(const KernelContext& context, const Kernels& kernels,
            std::span<const Placement> placements, const ExecutorOptions& options)
      : c_(context),
        kernels_(options.simd ? kernels.wide : kernels.one),
        wide_lanes_(kernels.wide.lanes),
        opacity_{&context, kernels.opacity},
        material_of_placement_(Materials(placements, options.bins)),
        options_(options),
        in_flight_(PathsThatFit(options)),
        bins_(MaterialCount(material_of_placement_), options.bins ? context.max_depth : 0,
              in_flight_, BlockItems(options, 256)),
        pool_(in_flight_, options.threads),
        paths_(pool_.capacity()),
        tallies_(options.threads) {
    BuildGraph();
  }

  std::string_view name() const override { return "wavefront"; }
  std::string Dot() const override { return graph_.dot(); }
  uint64_t PathsInFlight() const override { return in_flight_; }
  PassReport Render(const CameraPass& pass, const std::atomic<bool>& stop,
                    const std::function<void(double)>& progress) override;

 private:
  void BuildGraph();
  void CameraKernel(const Batch<CameraPacket>& batch, Emitter& out);
  void StartPaths(std::span<const CameraPacket> packets, uint32_t worker, WorkerTally& tally,
                  Emitter& out);
  void EndRays(CameraRays& rays, std::span<const uint32_t> places);
  void IntersectKernel(const Batch<Slot>& batch, Emitter& out);
  void ShadeKernel(const Batch<Slot>& batch, Emitter& out);
  void ShadowKernel(const Batch<Slot>& batch, Emitter& out);
  void MissKernel(const Batch<Slot>& batch, Emitter& out);
  void FilmKernel(const Batch<Slot>& batch);

  enum Fate { kIdle, kMissed, kHit };
  using ByFate = Partition<3, CameraRays::kMost>;
  static ByFate SplitByFate(const CameraRays& rays);
  using ByHit = Partition<2, kPathsAtOnce>;
  ByHit SplitByHit(std::span<const Slot> slots) const;
  void EmitHits(std::span<const Slot> slots, Emitter& out) const;
  void EndPaths(std::span<const Slot> slots, uint32_t worker);
  SourceStatus ClaimPackets(SourceContext& source, Emitter& out);

  const KernelContext& c_;
  KernelSet kernels_;
  int wide_lanes_;
  OpacityQuery opacity_;
  std::vector<int32_t> material_of_placement_;  // 4 bytes a placement instead of its whole record
  ExecutorOptions options_;
  uint32_t in_flight_;
  ShadeBins bins_;
  SlotPool pool_;
  UnsetHugeVector<PathState> paths_;
  std::vector<WorkerTally> tallies_;
  bool has_environment_ = false, has_shadow_ = false;

  Graph graph_;
  StageHandle<CameraPacket> camera_;
  StageHandle<Slot> intersect_, shade_, shadow_, miss_, film_;

  // Of the pass under way.
  CameraWork* work_ = nullptr;
  const std::atomic<bool>* stop_ = nullptr;
};

/// The lecture's loop as a graph: camera rays are traced, hits shaded, shadow rays traced, and what
/// goes on is traced again, until the film has it.
void Wavefront::BuildGraph() {
  has_environment_ = c_.lights.environment.width > 0;
  has_shadow_ = HasLights(c_.lights) && c_.max_depth > 0;
  const uint32_t lanes = static_cast<uint32_t>(kernels_.lanes);
  const auto stage = [&](const char* name, uint32_t bins, uint32_t stage_lanes, int rank) {
    return graph_.add_stage<Slot>({.name = name,
                                   .bins = bins,
                                   .block_items = BlockItems(options_, 256),
                                   .lanes = stage_lanes,
                                   .rank = rank,
                                   .weight = 1});
  };
  camera_ =
      graph_.add_stage<CameraPacket>({.name = "camera", .block_items = 32, .rank = 0, .weight = 8});
  intersect_ = stage("intersect", 1, 1, 1);
  shade_ = stage("shade", bins_.count(), lanes, 2);
  if (has_shadow_) shadow_ = stage("shadow", 1, 1, 3);
  film_ = stage("film", 1, 1, 5);
  if (has_environment_) miss_ = stage("environment", 1, lanes, 4);

  const SourceHandle pixels = graph_.add_source(
      {.name = "pixels", .fan_out = 8, .concurrency = 0, .burst = kClaim},
      [this](SourceContext& source, Emitter& out) { return ClaimPackets(source, out); });
  graph_.set_kernel(camera_,
                    [this](const Batch<CameraPacket>& b, Emitter& out) { CameraKernel(b, out); });
  graph_.set_kernel(intersect_,
                    [this](const Batch<Slot>& b, Emitter& out) { IntersectKernel(b, out); });
  graph_.set_kernel(shade_, [this](const Batch<Slot>& b, Emitter& out) { ShadeKernel(b, out); });
  graph_.set_kernel(film_, [this](const Batch<Slot>& b, Emitter&) { FilmKernel(b); });

  graph_.add_edge(pixels, camera_);
  graph_.add_edge(camera_, shade_);
  for (const StageHandle<Slot>& after_trace : {shade_, has_environment_ ? miss_ : film_})
    graph_.add_edge(intersect_, after_trace);
  for (const StageHandle<Slot>& after_shade : {intersect_, film_}) {
    graph_.add_edge(shade_, after_shade);
  }
  if (has_shadow_) {
    graph_.set_kernel(shadow_,
                      [this](const Batch<Slot>& b, Emitter& out) { ShadowKernel(b, out); });
    graph_.add_edge(shade_, shadow_);
    graph_.add_edge(shadow_, intersect_);
    graph_.add_edge(shadow_, film_);
  }
  if (has_environment_) {
    graph_.set_kernel(miss_, [this](const Batch<Slot>& b, Emitter& out) { MissKernel(b, out); });
    graph_.add_edge(miss_, film_);
  }
}

/// Traced paths that hit nothing, list 0, and those that hit something, list 1.
Wavefront::ByHit Wavefront::SplitByHit(std::span<const Slot> slots) const {
  return {slots, [&](Slot slot, size_t) { return paths_[slot].placement >= 0 ? 1 : 0; }};
}

/// Each to the bin of what it hit.
void Wavefront::EmitHits(std::span<const Slot> slots, Emitter& out) const {
  out.emit_each(slots, [&](Slot slot) {
    const PathState& path = paths_[slot];
    return std::pair(shade_, bins_.Of(material_of_placement_[path.placement], path.flags));
  });
}

SourceStatus Wavefront::ClaimPackets(SourceContext& source, Emitter& out) {
  if (stop_->load(std::memory_order_relaxed)) return SourceStatus::exhausted;
  const bool more = work_->Claim(source.worker, source.budget,
                                 [&](const CameraPacket& p) { out.emit(camera_, 0, p); });
  return more ? SourceStatus::more : SourceStatus::exhausted;
}

void Wavefront::CameraKernel(const Batch<CameraPacket>& batch, Emitter& out) {
  const FlushDenormals denormals;
  WorkerTally& tally = tallies_[batch.worker];
  for (size_t i = 0; i < batch.items.size(); i += kPacketsAtOnce) {
    StartPaths(batch.items.subspan(i, std::min(kPacketsAtOnce, batch.items.size() - i)),
               batch.worker, tally, out);
  }
}

void Wavefront::StartPaths(std::span<const CameraPacket> packets, uint32_t worker,
                           WorkerTally& tally, Emitter& out) {
  CameraRays rays;
  for (const CameraPacket& packet : packets) AddGroup(c_, packet, rays);
  kernels_.camera(c_, rays);
  IntersectCameraRays(c_.trace, rays);
  const ByFate by_fate = SplitByFate(rays);
  const std::span<const uint32_t> missed = by_fate.List(kMissed), hit = by_fate.List(kHit);
  tally.rays.camera += missed.size() + hit.size();
  if (!missed.empty()) EndRays(rays, missed);

  std::array<Slot, CameraRays::kMost> taken;
  const std::span<Slot> slots = std::span(taken).first(hit.size());
  pool_.Take(worker, slots);
  for (size_t i = 0; i < hit.size(); ++i) StartPath(rays, hit[i], paths_[slots[i]]);
  EmitHits(slots, out);
}

/// The places of traced camera rays by what becomes of them.
Wavefront::ByFate Wavefront::SplitByFate(const CameraRays& rays) {
  static constexpr auto kPlaces = [] {
    std::array<uint32_t, CameraRays::kMost> places;
    std::iota(places.begin(), places.end(), 0u);
    return places;
  }();
  return {std::span(kPlaces).first(rays.count), [&](uint32_t place, size_t) {
            return rays.inside[place] == 0 ? kIdle : rays.placement[place] < 0 ? kMissed : kHit;
          }};
}

/// To the film, with what they see of the background.
void Wavefront::EndRays(CameraRays& rays, std::span<const uint32_t> places) {
  for (const uint32_t place : places) c_.film->Prefetch(rays.pixel[place], rays.sample[place]);
  kernels_.background(c_, rays);
  FilmAccumulator::Writer film(*c_.film);
  for (const uint32_t place : places) {
    const float radiance[3] = {rays.radiance[0][place], rays.radiance[1][place],
                               rays.radiance[2][place]};
    film.Add(rays.pixel[place], rays.sample[place], radiance);
  }
}

void Wavefront::IntersectKernel(const Batch<Slot>& batch, Emitter& out) {
  const FlushDenormals denormals;
  EachFew(batch.items, [&](std::span<const Slot> some) {
    if (options_.simd) {
      IntersectPaths(c_.trace, paths_.data(), some);
    } else {
      for (const Slot slot : some) IntersectPath(c_.trace, paths_[slot]);
    }
    const ByHit by_hit = SplitByHit(some);
    out.emit(has_environment_ ? miss_ : film_, 0, by_hit.List(0));
    EmitHits(by_hit.List(1), out);
  });
  tallies_[batch.worker].rays.bounce += batch.items.size();
}

void Wavefront::ShadeKernel(const Batch<Slot>& batch, Emitter& out) {
  const FlushDenormals denormals;
  EachFew(batch.items, [&](std::span<const Slot> some) {
    std::array<Next, kPathsAtOnce> next;
    kernels_.shade(c_, paths_.data(), some, next.data());
    const Partition<3, kPathsAtOnce> by_next(
        some, [&](Slot, size_t i) { return static_cast<size_t>(next[i]); });
    if (has_shadow_) out.emit(shadow_, 0, by_next.List(static_cast<size_t>(Next::shadow)));
    out.emit(intersect_, 0, by_next.List(static_cast<size_t>(Next::trace)));
    out.emit(film_, 0, by_next.List(static_cast<size_t>(Next::film)));
  });
}

void Wavefront::ShadowKernel(const Batch<Slot>& batch, Emitter& out) {
  const FlushDenormals denormals;
  EachFew(batch.items, [&](std::span<const Slot> some) {
    if (options_.simd) {
      TraceShadows(c_.trace, opacity_, paths_.data(), some);
    } else {
      for (const Slot slot : some) TraceShadow(c_.trace, opacity_, paths_[slot]);
    }
    const Partition<2, kPathsAtOnce> by_life(
        some, [&](Slot slot, size_t) { return (paths_[slot].flags & kPathAlive) != 0 ? 1 : 0; });
    out.emit(film_, 0, by_life.List(0));
    out.emit(intersect_, 0, by_life.List(1));
  });
  tallies_[batch.worker].rays.shadow += batch.items.size();
}

void Wavefront::MissKernel(const Batch<Slot>& batch, Emitter& out) {
  const FlushDenormals denormals;
  kernels_.miss(c_, paths_.data(), batch.items);
  out.emit(film_, 0, batch.items);
}

void Wavefront::FilmKernel(const Batch<Slot>& batch) {
  const FlushDenormals denormals;
  EndPaths(batch.items, batch.worker);
}

/// To the film; their slots are free then.
void Wavefront::EndPaths(std::span<const Slot> slots, uint32_t worker) {
  constexpr size_t kAhead = 12;
  FilmAccumulator::Writer film(*c_.film);
  for (size_t i = 0; i < slots.size(); ++i) {
    if (i + 2 * kAhead < slots.size()) PrefetchPath(&paths_[slots[i + 2 * kAhead]]);
    if (i + kAhead < slots.size()) {
      const PathState& ahead = paths_[slots[i + kAhead]];
      c_.film->Prefetch(ahead.pixel, ahead.sample);
    }
    const PathState& path = paths_[slots[i]];
    film.Add(path.pixel, path.sample, path.radiance);
  }
  pool_.Give(worker, slots);
}

PassReport Wavefront::Render(const CameraPass& pass, const std::atomic<bool>& stop,
                             const std::function<void(double)>& progress) {
  CameraWork work(c_.width, c_.height, pass, options_.threads);
  work_ = &work;
  stop_ = &stop;
  for (WorkerTally& tally : tallies_) tally.rays = {};

  RunOptions run_options;
  run_options.threads = options_.threads;
  run_options.arena = options_.arena;
  run_options.in_flight = in_flight_;
  run_options.policy = options_.policy;
  run_options.trace = options_.trace;
  if (progress) run_options.progress = [&](const Progress&) { progress(work.Fraction()); };
  PassReport report;
  report.schedule = run(graph_, run_options);
  if (const std::string note = bins_.Note(); !note.empty()) report.schedule.notes.push_back(note);

  for (const WorkerTally& tally : tallies_) report.rays += tally.rays;
  report.seconds = report.schedule.seconds;
  report.stopped = work.Fraction() < 1;
  report.state_bytes = paths_.size() * sizeof(PathState);
  for (const StageReport& stage : report.schedule.stages) {
    if (stage.name != "shade") continue;
    report.run_length = stage.run_length;
    report.seats_filled = stage.seats_filled * kernels_.lanes / wide_lanes_;
  }
  report.idle_seconds = report.schedule.idle_seconds;
  work_ = nullptr;
  return report;
}

}  // namespace

std::unique_ptr<Executor> MakeWavefront(const KernelContext& context, const Kernels& kernels,
                                        std::span<const Placement> placements,
                                        const ExecutorOptions& options) {
  return std::make_unique<Wavefront>(context, kernels, placements, options);
}

}  // namespace carpool::stages
