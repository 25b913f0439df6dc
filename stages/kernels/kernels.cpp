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

template <class D>
void Camera(const KernelContext& c, PathState* paths, std::span<const uint32_t> slots) {
  const D d;
  for (size_t i = 0; i < slots.size(); i += hn::Lanes(d)) {
    CameraLanes(d, c, LoadSlots(d, paths, slots.data() + i, slots.size() - i));
  }
  Check("camera", paths, slots);
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
  return {static_cast<int>(hn::Lanes(D())), &Camera<D>, &Shade<D>, &Miss<D>};
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
