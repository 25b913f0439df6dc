// The recursive executors: path tracing as textbooks write it, serial or parallel over pixels or
// paths.
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <vector>

#include "stages/executors/busy_clock.h"
#include "stages/executors/camera_group.h"
#include "stages/executors/ladder.h"
#include "stages/simd/denormals.h"

namespace carpool::stages {
namespace {

class Recursive final : public Executor {
 public:
  Recursive(const KernelContext& context, const Kernels& kernels, const ExecutorOptions& options,
            Grain grain)
      : c_(context),
        kernels_(kernels.one),
        camera_(kernels.wide.camera),
        lanes_(kernels.wide.lanes),
        opacity_{&context, kernels.opacity},
        options_(options),
        grain_(grain) {}

  std::string_view name() const override { return "recursive"; }
  std::string Dot() const override { return {}; }
  PassReport Render(const CameraPass& pass, const std::atomic<bool>& stop,
                    const std::function<void(double)>& progress) override;

 private:
  void RenderPacket(const CameraPacket& packet, RayCounts& rays) const;
  void Radiance(PathState& path, RayCounts& rays) const;

  const KernelContext& c_;
  KernelSet kernels_;
  CameraKernel camera_;
  int lanes_;
  OpacityQuery opacity_;
  ExecutorOptions options_;
  Grain grain_;
};

/// The radiance that arrives along the path, from its hit on. Each vertex has a record of its own
/// on the stack, which is what recursion costs.
void Recursive::Radiance(PathState& path, RayCounts& rays) const {
  constexpr uint32_t kZero = 0;
  const std::span<const uint32_t> first(&kZero, 1);
  if (path.placement < 0) {
    kernels_.miss(c_, &path, first);
    return;
  }
  Next next = Next::film;
  kernels_.shade(c_, &path, first, &next);
  if (next == Next::shadow) {
    TraceShadow(c_.trace, opacity_, path);
    ++rays.shadow;
    next = (path.flags & kPathAlive) != 0 ? Next::trace : Next::film;
  }
  if (next == Next::film) return;
  PathState further = path;
  IntersectPath(c_.trace, further);
  ++rays.bounce;
  Radiance(further, rays);
  for (int channel = 0; channel < 3; ++channel) path.radiance[channel] = further.radiance[channel];
}

void Recursive::RenderPacket(const CameraPacket& packet, RayCounts& rays) const {
  CameraGroup group = TraceCameraGroup(c_, camera_, packet);
  rays.camera += group.count;
  for (size_t i = 0; i < group.count; ++i) {
    PathState& path = group.paths[i];
    Radiance(path, rays);
    c_.film->Add(path.pixel, path.sample, path.radiance);
  }
}

PassReport Recursive::Render(const CameraPass& pass, const std::atomic<bool>& stop,
                             const std::function<void(double)>& progress) {
  const auto begin = std::chrono::steady_clock::now();
  std::vector<CameraPacket> packets;
  CameraWork all(c_.width, c_.height, pass);
  while (all.Claim(0, kGroupsPerTile, [&](const CameraPacket& p) { packets.push_back(p); })) {
  }
  if (grain_ == Grain::pixel) {  // all samples of a group of pixels are one piece of work
    std::stable_sort(packets.begin(), packets.end(), [](const auto& a, const auto& b) {
      return a.y != b.y ? a.y < b.y : a.x < b.x;
    });
  }
  const size_t grain = grain_ == Grain::pixel ? pass.sample_count : 1;
  const uint32_t threads = grain_ == Grain::serial ? 1 : options_.threads;
  BusyClock clock(threads);
  tbb::enumerable_thread_specific<RayCounts> tallies;
  std::atomic<size_t> done{0};
  const auto piece = [&](size_t first, size_t last) {
    const FlushDenormals denormals;
    const BusyClock::Scope busy(clock);
    RayCounts& rays = tallies.local();
    for (size_t i = first; i < last && !stop.load(std::memory_order_relaxed); ++i) {
      RenderPacket(packets[i], rays);
      ++done;
    }
    if (progress && first == 0) progress(static_cast<double>(done) / packets.size());
  };
  if (grain_ == Grain::serial) {
    piece(0, packets.size());
  } else {
    const size_t pieces = (packets.size() + grain - 1) / grain;
    options_.arena->execute([&] {
      tbb::parallel_for(size_t{0}, pieces, [&](size_t p) {
        piece(p * grain, std::min((p + 1) * grain, packets.size()));
      });
    });
  }

  PassReport report;
  for (const RayCounts& rays : tallies) report.rays += rays;
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  report.stopped = done < packets.size();
  report.state_bytes = uint64_t{threads} * (8 + c_.max_depth) * sizeof(PathState);
  report.seats_filled = 1.0 / lanes_;
  report.idle_seconds = clock.Idle(report.seconds);
  return report;
}

}  // namespace

std::unique_ptr<Executor> MakeRecursive(const KernelContext& context, const Kernels& kernels,
                                        const ExecutorOptions& options, Grain grain) {
  return std::make_unique<Recursive>(context, kernels, options, grain);
}

}  // namespace carpool::stages
