// The megakernel executor: one loop per path over tiles in parallel, from the same kernels at one
// lane.
#include "stages/executors/camera_group.h"
#include "stages/executors/follow_path.h"
#include "stages/executors/packet_loop.h"

namespace carpool::stages {
namespace {

class Megakernel final : public Executor {
 public:
  Megakernel(const KernelContext& context, const Kernels& kernels, const ExecutorOptions& options)
      : c_(context), kernels_(kernels.one), opacity_{&context, kernels.opacity}, options_(options) {
    // Camera rays come in packets anyway, so they may be made at full width.
    camera_ = kernels.wide.camera;
    wide_lanes_ = kernels.wide.lanes;
  }

  std::string_view name() const override { return "megakernel"; }
  std::string Dot() const override { return {}; }
  PassReport Render(const CameraPass& pass, const std::atomic<bool>& stop,
                    const std::function<void(double)>& progress) override;

 private:
  void RenderPacket(const CameraPacket& packet, RayCounts& rays) const;

  const KernelContext& c_;
  KernelSet kernels_;
  CameraKernel camera_;
  int wide_lanes_ = 1;
  OpacityQuery opacity_;
  ExecutorOptions options_;
};

void Megakernel::RenderPacket(const CameraPacket& packet, RayCounts& rays) const {
  CameraGroup group = TraceCameraGroup(c_, camera_, packet);
  rays.camera += group.count;
  const auto count = [&rays](PathStep step, const PathState&) {
    rays.shadow += step == PathStep::shadowed ? 1 : 0;
    rays.bounce += step == PathStep::traced ? 1 : 0;
  };
  for (size_t i = 0; i < group.count; ++i) {
    PathState& path = group.paths[i];
    FollowPath(c_, kernels_, opacity_, path, count);
    c_.film->Add(path.pixel, path.sample, path.radiance);
  }
}

PassReport Megakernel::Render(const CameraPass& pass, const std::atomic<bool>& stop,
                              const std::function<void(double)>& progress) {
  PassReport report = RunPackets<RayCounts>(
      c_, options_, pass, stop, progress,
      [this](const CameraPacket& packet, RayCounts& rays) { RenderPacket(packet, rays); },
      [](const RayCounts& rays, PassReport& r) { r.rays += rays; });
  report.seats_filled = 1.0 / wide_lanes_;
  report.state_bytes = uint64_t{options_.threads} * 8 * sizeof(PathState);
  return report;
}

}  // namespace

std::unique_ptr<Executor> MakeMegakernel(const KernelContext& context, const Kernels& kernels,
                                         const ExecutorOptions& options) {
  return std::make_unique<Megakernel>(context, kernels, options);
}

}  // namespace carpool::stages
