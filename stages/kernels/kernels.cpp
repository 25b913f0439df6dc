// Instantiates every kernel for each instruction set, at full width and at one lane, and lists the
// tables.
#include "stages/kernels/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stages/kernels/kernels.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
#include "hwy/highway.h"
#include "stages/kernels/camera-inl.h"
#include "stages/kernels/check_outputs.h"
#include "stages/kernels/shade-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {
namespace {

using Wide = hn::ScalableTag<float>;
using One = hn::CappedTag<float, 1>;

void Check(const char* kernel, const PathState* paths, std::span<const uint32_t> slots) {
  if constexpr (kCheckOutputs) {
    for (const uint32_t slot : slots) CheckOutput(kernel, paths[slot]);
  }
}

void Check(const char* kernel, const CameraRays& rays) {
  if constexpr (kCheckOutputs) {
    for (uint32_t i = 0; i < rays.count; ++i) {
      if (rays.inside[i] == 0) continue;
      PathState path;
      StartPath(rays, i, path);
      for (int channel = 0; channel < 3; ++channel)
        path.radiance[channel] = rays.radiance[channel][i];
      CheckOutput(kernel, path);
    }
  }
}

template <class D>
Vec3<D> LoadTriple(D d, const float (&from)[3][CameraRays::kMost], size_t i) {
  return {hn::LoadU(d, from[0] + i), hn::LoadU(d, from[1] + i), hn::LoadU(d, from[2] + i)};
}
template <class D>
void StoreTriple(D d, const Vec3<D>& v, float (&to)[3][CameraRays::kMost], size_t i) {
  hn::StoreU(v.x, d, to[0] + i);
  hn::StoreU(v.y, d, to[1] + i);
  hn::StoreU(v.z, d, to[2] + i);
}
static_assert(CameraRays::kMost % hn::MaxLanes(Wide()) == 0);

template <class D>
void Camera(const KernelContext& c, CameraRays& rays) {
  const D d;
  const UintTag<D> du;
  const CameraCone cone = ConeOf(c);
  rays.cone_width = static_cast<float>(cone.width);
  rays.cone_spread = static_cast<float>(cone.spread);
  for (size_t i = 0; i < rays.count; i += hn::Lanes(d)) {
    const CameraRay<D> ray =
        MakeCameraRay(d, c, hn::LoadU(du, rays.pixel + i), hn::LoadU(du, rays.sample + i));
    StoreTriple(d, ray.origin, rays.origin, i);
    StoreTriple(d, ray.direction, rays.direction, i);
    StoreTriple(d, Splat3(d, 0, 0, 0), rays.radiance, i);
  }
  Check("camera", rays);
}

template <class D>
void Background(const KernelContext& c, CameraRays& rays) {
  if (c.lights.environment.width == 0) return;
  const D d;
  const IntTag<D> di;
  for (size_t i = 0; i < rays.count; i += hn::Lanes(d)) {
    const auto missed = hn::Lt(hn::LoadU(di, rays.placement + i), hn::Zero(di));
    if (hn::AllFalse(di, missed)) continue;
    StoreTriple(d, EnvironmentRadiance(d, c.lights.environment, LoadTriple(d, rays.direction, i)),
                rays.radiance, i);
  }
  Check("background", rays);
}

template <class D>
void Shade(const KernelContext& c, PathState* paths, std::span<const uint32_t> slots, Next* next) {
  ShadePaths(D(), c, paths, slots, next);
  Check("shading", paths, slots);
}

template <class D>
void Miss(const KernelContext& c, PathState* paths, std::span<const uint32_t> slots) {
  const D d;
  for (size_t i = 0; i < slots.size(); i += hn::Lanes(d)) {
    PrefetchSlots(paths, slots, i + hn::Lanes(d), hn::Lanes(d));
    MissLanes(d, c, LoadSlots(d, paths, slots.data() + i, slots.size() - i));
  }
  Check("environment", paths, slots);
}

float OpacityAt(const void* context, int32_t placement, uint32_t primitive, float u, float v) {
  const KernelContext& c = *static_cast<const KernelContext*>(context);
  return hn::GetLane(PointOpacity(One(), c, placement, primitive, u, v));
}

template <class D>
KernelSet MakeSet() {
  return {static_cast<int>(hn::Lanes(D())), &Camera<D>, &Background<D>, &Shade<D>, &Miss<D>};
}

}  // namespace

Kernels MakeKernels(std::string_view isa) {
  return {isa, MakeSet<Wide>(), MakeSet<One>(), &OpacityAt};
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <vector>

#include "hwy/targets.h"

namespace carpool::stages {

std::span<const Kernels> AvailableKernels() {
  static const std::vector<Kernels> tables = [] {
    std::vector<Kernels> found;
    [[maybe_unused]] const auto supported = hwy::SupportedTargets();
#if HWY_TARGETS & HWY_AVX3
    if ((supported & HWY_AVX3) != 0) found.push_back(N_AVX3::MakeKernels("avx512"));
#endif
#if HWY_TARGETS & HWY_AVX2
    if ((supported & HWY_AVX2) != 0) found.push_back(N_AVX2::MakeKernels("avx2"));
#endif
#if HWY_TARGETS & HWY_SSE4
    if ((supported & HWY_SSE4) != 0) found.push_back(N_SSE4::MakeKernels("sse4"));
#endif
#if HWY_TARGETS & HWY_NEON
    found.push_back(N_NEON::MakeKernels("neon"));
#endif
    return found;
  }();
  return tables;
}

const Kernels* FindKernels(std::string_view isa) {
  for (const Kernels& kernels : AvailableKernels()) {
    if (isa == "auto" || isa == kernels.isa) return &kernels;
  }
  return nullptr;
}

}  // namespace carpool::stages
#endif  // HWY_ONCE
