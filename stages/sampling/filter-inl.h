// Filter importance sampling: where in the pixel filter a camera sample falls; all weights are 1.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_SAMPLING_FILTER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_SAMPLING_FILTER_INL_H_
#undef CARPOOL_STAGES_SAMPLING_FILTER_INL_H_
#else
#define CARPOOL_STAGES_SAMPLING_FILTER_INL_H_
#endif

#include "stages/sampling/filter_table.h"
#include "stages/sampling/lookup-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// One axis: linear interpolation of the inverse cumulative distribution at u in [0, 1).
template <class D>
HWY_INLINE Real<D> SampleFilterAxis(D d, Real<D> u) {
  const Real<D> position = u * Splat(d, kPixelFilterCells);
  const Index<D> cell = ToIndex(d, position);
  const float* knots = kPixelFilterKnots.data();
  const Vec2<D> ends = LookUpFloatPair(d, knots, cell);
  return hn::MulAdd(position - FromIndex(d, cell), ends.y - ends.x, ends.x);
}

/// Offset from the pixel's centre, in pixels.
template <class D>
HWY_INLINE Vec2<D> SamplePixelFilter(D d, const Vec2<D>& u) {
  return {SampleFilterAxis(d, u.x), SampleFilterAxis(d, u.y)};
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
