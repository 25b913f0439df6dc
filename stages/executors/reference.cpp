// The reference executor: every path in double, beside its float self.
#include "stages/executors/camera_group.h"
#include "stages/executors/follow_path.h"
#include "stages/executors/packet_loop.h"
#include "stages/kernels/reference_kernels.h"
#include "stages/simd/float_traps.h"

namespace carpool::stages {
namespace {

void CopyTriple(const double from[3], float to[3]) {
  for (int i = 0; i < 3; ++i) to[i] = static_cast<float>(from[i]);
}

/// The stages of one path in double. Embree answers in float: a float path asks for it, and
/// remembers what tracing must of the layers that the ray went through.
class ReferenceSteps {
 public:
  ReferenceSteps(const KernelContext& c, const OpacityQuery& opacity) : c_(c), opacity_(opacity) {}

  void Start(uint32_t pixel, uint32_t sample, ReferencePath& path) {
    path.pixel = pixel;
    path.sample = sample;
    path.placement = kNone;
    path.primitive = 0;
    CurrentTrapPlace() = {pixel, sample};
    ReferenceCamera(c_, path);
    float_ = {};
    float_.placement = kNone;
    Trace(path);
  }
  void Miss(ReferencePath& path) { ReferenceMiss(c_, path); }
  Next Shade(ReferencePath& path) { return ReferenceShade(c_, path); }

  void Shadow(ReferencePath& path) {
    CopyTriple(path.origin, float_.origin);
    CopyTriple(path.shadow_direction, float_.shadow_direction);
    float_.shadow_distance = static_cast<float>(path.shadow_distance);
    for (int i = 0; i < 3; ++i) float_.radiance[i] = 0;
    for (int i = 0; i < 3; ++i) float_.shadow_radiance[i] = 1;
    TraceShadow(c_.trace, opacity_, float_);
    const double through = float_.radiance[0];
    for (int i = 0; i < 3; ++i) path.radiance[i] += through * path.shadow_radiance[i];
    path.shadow_distance = 0;
  }

  void Trace(ReferencePath& path) {
    float_.flags = static_cast<uint32_t>(path.flags);
    if ((float_.flags & kPathLayerMask) == 0) {  // a new ray
      CopyTriple(path.origin, float_.origin);
      CopyTriple(path.direction, float_.direction);
      float_.tnear = 0;
    }
    IntersectPath(c_.trace, float_);
    path.placement = float_.placement;
    path.primitive = float_.primitive;
    path.u = float_.u;
    path.v = float_.v;
    path.distance = float_.distance;
    if (path.placement != kNone) RefineHit(c_, path);
  }

 private:
  const KernelContext& c_;
  const OpacityQuery& opacity_;
  PathState float_;
};

class Reference final : public Executor {
 public:
  Reference(const KernelContext& context, const Kernels& kernels, const ExecutorOptions& options)
      : c_(context), kernels_(kernels), options_(options) {}

  std::string_view name() const override { return "reference"; }
  std::string Dot() const override { return {}; }
  PassReport Render(const CameraPass& pass, const std::atomic<bool>& stop,
                    const std::function<void(double)>& progress) override;

 private:
  struct Tally {
    RayCounts rays;
    PathComparison comparison;
  };
  void RenderPacket(const CameraPacket& packet, Tally& tally) const;

  const KernelContext& c_;
  const Kernels& kernels_;
  ExecutorOptions options_;
};

void Reference::RenderPacket(const CameraPacket& packet, Tally& tally) const {
  PathProbe probe;
  KernelContext silent = c_;  // the float paths: neither film nor AOVs hear of them
  silent.probe = &probe;
  silent.first_hits = false;
  KernelContext c = c_;
  c.probe = &probe;
  CameraGroup group = TraceCameraGroup(silent, kernels_.wide.camera, packet);
  const OpacityQuery single_opacity{&c_, kernels_.opacity}, opacity{&c_, &ReferenceOpacity};
  PathRecorder single(probe), reference(probe);
  tally.rays.camera += group.count;
  for (size_t i = 0; i < group.count; ++i) {
    PathState& path = group.paths[i];
    single.Clear();
    FollowPath(silent, kernels_.one, single_opacity, path, single);

    ReferenceSteps steps(c, opacity);
    ReferencePath wide;
    steps.Start(path.pixel, path.sample, wide);
    reference.Clear();
    FollowPath(steps, wide, reference);
    float sample[3];
    CopyTriple(wide.radiance, sample);
    c_.film->Add(path.pixel, path.sample, sample);
    for (const PathMoment& m : reference.moments()) {
      tally.rays.shadow += m.step == PathStep::shadowed ? 1 : 0;
      tally.rays.bounce += m.step == PathStep::traced ? 1 : 0;
    }
    tally.comparison.Add(path.pixel, path.sample, single.moments(), reference.moments());
  }
}

PassReport Reference::Render(const CameraPass& pass, const std::atomic<bool>& stop,
                             const std::function<void(double)>& progress) {
  PassReport report = RunPackets<Tally>(
      c_, options_, pass, stop, progress,
      [this](const CameraPacket& packet, Tally& tally) { RenderPacket(packet, tally); },
      [](const Tally& tally, PassReport& r) {
        r.rays += tally.rays;
        r.comparison += tally.comparison;
      });
  report.seats_filled = 1.0 / kernels_.wide.lanes;
  report.state_bytes = uint64_t{options_.threads} * (8 * sizeof(PathState) + sizeof(ReferencePath));
  return report;
}

}  // namespace

std::unique_ptr<Executor> MakeReference(const KernelContext& context, const Kernels& kernels,
                                        const ExecutorOptions& options) {
  return std::make_unique<Reference>(context, kernels, options);
}

}  // namespace carpool::stages
