// Small numerics that only lights need: atan2, angle differences from sines and cosines, safe
// square roots.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_LIGHT_MATH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_LIGHT_MATH_INL_H_
#undef CARPOOL_STAGES_KERNELS_LIGHT_MATH_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_LIGHT_MATH_INL_H_
#endif

#include "stages/simd/lanes-inl.h"
#ifndef CARPOOL_ONE_DOUBLE
#include "hwy/contrib/math/math-inl.h"
#endif

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {
namespace lights {

constexpr double kPi = 3.14159265358979323846;
constexpr double kLargestBelowOne = 0.999999940395355224609375;  // 1 - 2^-24, in float

/// Angle of the vector (x, y) in [-pi, pi]; (0, 0) gives 0. Error below 4e-7. Not named Atan2:
/// newer Highways have one, which argument-dependent lookup would find too.
template <class D>
HWY_INLINE Real<D> AngleOf(D d, Real<D> y, Real<D> x) {
  const Real<D> ax = hn::Abs(x), ay = hn::Abs(y);
  const Real<D> ratio = SafeDiv(d, hn::Min(ax, ay), hn::Max(ax, ay));
  const Real<D> first_octant = hn::Atan(d, ratio);
  const Real<D> first_quadrant =
      hn::IfThenElse(hn::Gt(ay, ax), Splat(d, kPi / 2) - first_octant, first_octant);
  const Real<D> half_plane =
      hn::IfThenElse(hn::Lt(x, hn::Zero(d)), Splat(d, kPi) - first_quadrant, first_quadrant);
  return hn::CopySign(half_plane, y);
}

/// An angle in [0, pi] by its cosine and sine.
template <class D>
struct Angle {
  Real<D> cos, sin;
};

template <class D>
HWY_INLINE Angle<D> AngleFromCos(D d, Real<D> cos) {
  return {cos, SafeSqrt(d, hn::NegMulAdd(cos, cos, Splat(d, 1)))};
}

/// max(0, a - b).
template <class D>
HWY_INLINE Angle<D> SubtractClamped(D d, const Angle<D>& a, const Angle<D>& b) {
  const Mask<D> positive = hn::Lt(a.cos, b.cos);
  return {hn::IfThenElse(positive, hn::MulAdd(a.cos, b.cos, a.sin * b.sin), Splat(d, 1)),
          hn::IfThenElseZero(positive, hn::MulSub(a.sin, b.cos, a.cos * b.sin))};
}

/// A mask of a signed integer tag as the mask of `d`, which has lanes of the same size.
template <class D>
HWY_INLINE Mask<D> ToMask(D d, hn::Mask<IntTag<D>> mask) {
  return hn::RebindMask(d, mask);
}
template <class D>
HWY_INLINE hn::Mask<IntTag<D>> ToIntMask(D, Mask<D> mask) {
  return hn::RebindMask(IntTag<D>(), mask);
}

}  // namespace lights
}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
