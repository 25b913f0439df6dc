// Small numerics that only lights need: atan2, sine with cosine, angle differences from sines and
// cosines.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_LIGHT_MATH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_LIGHT_MATH_INL_H_
#undef CARPOOL_STAGES_KERNELS_LIGHT_MATH_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_LIGHT_MATH_INL_H_
#endif

#include "stages/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {
namespace lights {

constexpr double kPi = 3.14159265358979323846;
constexpr double kLargestBelowOne = 0.999999940395355224609375;  // 1 - 2^-24, in float

/// An angle by its cosine and sine.
template <class D>
struct Angle {
  Real<D> cos, sin;
};

#ifdef CARPOOL_ONE_DOUBLE
template <class D>
HWY_INLINE Real<D> ArcTangent(D d, Real<D> x) {
  return hn::Atan(d, x);
}
template <class D>
HWY_INLINE Real<D> AcuteSine(D d, Real<D> x) {
  return hn::Sin(d, x);
}
template <class D>
HWY_INLINE Real<D> AcuteCosine(D d, Real<D> x) {
  return hn::Cos(d, x);
}
#else
/// Coefficients from the constant one on; even and odd powers apart, so that neither waits for the
/// other.
template <class D, size_t kCount>
HWY_INLINE Real<D> Polynomial(D d, Real<D> x, const double (&coefficients)[kCount]) {
  const Real<D> square = x * x;
  const auto sum = [&](size_t last) HWY_ATTR {
    Real<D> of_power = Splat(d, coefficients[last]);
    for (size_t i = last; i >= 2; i -= 2)
      of_power = hn::MulAdd(of_power, square, Splat(d, coefficients[i - 2]));
    return of_power;
  };
  const Real<D> a = sum(kCount - 1), b = sum(kCount - 2);
  return kCount % 2 == 1 ? hn::MulAdd(b, x, a) : hn::MulAdd(a, x, b);
}
// Minimax polynomials, fitted by reweighted least squares: rounding apart, the arc tangent of 0 to
// 1 is off by less than 2e-8 of itself, the sine of -pi/2 to pi/2 by 6e-9 of itself, and the cosine
// there by 3e-10. Shorter than Highway's, which take any argument.
template <class D>
HWY_INLINE Real<D> ArcTangent(D d, Real<D> x) {
  return x * Polynomial(d, x * x,
                        {1.0, -0.3333307206630707, 0.1999261975288391, -0.14203645288944244,
                         0.10640934109687805, -0.07504294812679291, 0.04269151762127876,
                         -0.016068624332547188, 0.0028498878236860037});
}
template <class D>
HWY_INLINE Real<D> AcuteSine(D d, Real<D> x) {
  return x * Polynomial(d, x * x,
                        {1.0, -0.16666656732559204, 0.008333024568855762, -0.00019807404896710068,
                         2.6018724383902736e-06});
}
template <class D>
HWY_INLINE Real<D> AcuteCosine(D d, Real<D> x) {
  return Polynomial(d, x * x,
                    {1.0, -0.5, 0.04166663438081741, -0.0013888360699638724, 2.476014560670592e-05,
                     -2.6051202439703047e-07});
}
#endif

/// Of an angle in [-pi, pi].
template <class D>
HWY_INLINE Angle<D> AngleFromRadians(D d, Real<D> angle) {
  const Real<D> half = Splat(d, 0.5) * angle;
  const Real<D> sin = AcuteSine(d, half), cos = AcuteCosine(d, half);
  return {(cos - sin) * (cos + sin), Splat(d, 2) * sin * cos};
}

/// Angle of the vector (x, y) in [-pi, pi]; (0, 0) gives 0. Error below 4e-7. Not named Atan2:
/// newer Highways have one, which argument-dependent lookup would find too.
template <class D>
HWY_INLINE Real<D> AngleOf(D d, Real<D> y, Real<D> x) {
  const Real<D> ax = hn::Abs(x), ay = hn::Abs(y);
  const Real<D> ratio = SafeDiv(d, hn::Min(ax, ay), hn::Max(ax, ay));
  const Real<D> first_octant = ArcTangent(d, ratio);
  const Real<D> first_quadrant =
      hn::IfThenElse(hn::Gt(ay, ax), Splat(d, kPi / 2) - first_octant, first_octant);
  const Real<D> half_plane =
      hn::IfThenElse(hn::Lt(x, hn::Zero(d)), Splat(d, kPi) - first_quadrant, first_quadrant);
  return hn::CopySign(half_plane, y);
}

template <class D>
HWY_INLINE Angle<D> AngleFromCos(D d, Real<D> cos) {
  return {cos, SafeSqrt(d, hn::NegMulAdd(cos, cos, Splat(d, 1)))};
}

/// max(0, a - b) of angles in [0, pi].
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
