// Warps from the unit square: the unit circle, the disk, the cosine-weighted hemisphere.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_SAMPLING_WARP_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_SAMPLING_WARP_INL_H_
#undef CARPOOL_STAGES_SAMPLING_WARP_INL_H_
#else
#define CARPOOL_STAGES_SAMPLING_WARP_INL_H_
#endif

#include <numbers>

#include "stages/sampling/lookup-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// (cos, sin) of 2 pi turns, for |turns| up to 2^20: reduced exactly to an eighth of a turn either
/// way, then Taylor polynomials, whose remainder there is below 2e-9.
template <class D>
HWY_INLINE Vec2<D> CosSinTurns(D d, Real<D> turns) {
  if constexpr (kReference<D>) {
    const auto angle = 2 * std::numbers::pi * hn::GetLane(turns);
    return {hn::Set(d, std::cos(angle)), hn::Set(d, std::sin(angle))};
  }
  const Real<D> quarters = hn::Round(turns * Splat(d, 4));
  const Real<D> angle =
      hn::NegMulAdd(quarters, Splat(d, 0.25), turns) * Splat(d, 2 * std::numbers::pi);
  const Real<D> a2 = angle * angle;
  Real<D> cosine = hn::MulAdd(a2, Splat(d, -1.0 / 3628800), Splat(d, 1.0 / 40320));
  cosine = hn::MulAdd(cosine, a2, Splat(d, -1.0 / 720));
  cosine = hn::MulAdd(cosine, a2, Splat(d, 1.0 / 24));
  cosine = hn::MulAdd(cosine, a2, Splat(d, -0.5));
  cosine = hn::MulAdd(cosine, a2, Splat(d, 1));
  Real<D> sine = hn::MulAdd(a2, Splat(d, 1.0 / 362880), Splat(d, -1.0 / 5040));
  sine = hn::MulAdd(sine, a2, Splat(d, 1.0 / 120));
  sine = hn::MulAdd(sine, a2, Splat(d, -1.0 / 6));
  sine = hn::MulAdd(sine * a2, angle, angle);

  // Quadrant q turns (c, s) into (c, s), (-s, c), (-c, -s), (s, -c).
  const IndexTag<D> di;
  const Index<D> quadrant = ToIndex(d, quarters);
  const Real<D> odd = FromIndex(d, hn::And(quadrant, hn::Set(di, 1)));
  const Real<D> half = FromIndex(d, hn::And(quadrant, hn::Set(di, 2)));
  const Mask<D> swap = hn::Ne(odd, hn::Zero(d));
  const Real<D> x = hn::IfThenElse(swap, hn::Neg(sine), cosine);
  const Real<D> y = hn::IfThenElse(swap, cosine, sine);
  const Real<D> sign = Splat(d, 1) - half;
  return {x * sign, y * sign};
}

/// 2^n by its exponent bits, for |n| < 127. (Highway's shifts by a variable count are wrong at one
/// lane on x86: they read the register's unused lanes as part of the count.)
template <class D>
HWY_INLINE Real<D> PowerOfTwo(D d, Index<D> n) {
  const hn::Rebind<float, D> df;
  const auto power = hn::BitCast(df, hn::ShiftLeft<23>(n + hn::Set(IndexTag<D>(), 127)));
  if constexpr (sizeof(hn::TFromD<D>) == 4) {
    return power;
  } else {
    return hn::PromoteTo(d, power);
  }
}

/// 2^x - 1 for 0 <= x < 30, to a few units in the last place even where it is tiny: Taylor
/// polynomial about the nearest integer (remainder below 1e-8).
template <class D>
HWY_INLINE Real<D> Exp2Minus1(D d, Real<D> x) {
  if constexpr (kReference<D>) return hn::Set(d, std::expm1(hn::GetLane(x) * std::numbers::ln2));
  const Real<D> whole = hn::Round(x);
  const Real<D> f = (x - whole) * Splat(d, std::numbers::ln2);
  Real<D> y = hn::MulAdd(f, Splat(d, 1.0 / 5040), Splat(d, 1.0 / 720));
  y = hn::MulAdd(y, f, Splat(d, 1.0 / 120));
  y = hn::MulAdd(y, f, Splat(d, 1.0 / 24));
  y = hn::MulAdd(y, f, Splat(d, 1.0 / 6));
  y = hn::MulAdd(y, f, Splat(d, 0.5));
  y = hn::MulAdd(y * f, f, f);
  const Real<D> power = PowerOfTwo(d, ToIndex(d, whole));
  return hn::MulAdd(power, y, power - Splat(d, 1));
}

/// From the sampler's square to [-1, 1]^2, centred on its 2^-24 grid: no coordinate is ever -1, 0
/// or 1.
template <class D>
HWY_INLINE Vec2<D> SignedSquare(D d, const Vec2<D>& u) {
  const Real<D> offset = Splat(d, 0x1p-24 - 1);
  return {hn::MulAdd(u.x, Splat(d, 2), offset), hn::MulAdd(u.y, Splat(d, 2), offset)};
}

/// Concentric map of the square to the unit disk (Shirley and Chiu 1997); the distance from the
/// centre is max(|s.x|, |s.y|).
template <class D>
HWY_INLINE Vec2<D> ConcentricDisk(D d, const Vec2<D>& s) {
  const Mask<D> wide = hn::Gt(hn::Abs(s.x), hn::Abs(s.y));
  const Real<D> radius = hn::IfThenElse(wide, s.x, s.y);
  const Real<D> ratio = hn::IfThenElse(wide, s.y, s.x) / radius;
  // Around x the angle is `ratio` eighths of a turn; around y a quarter turn less that.
  const Vec2<D> direction = CosSinTurns(d, ratio * Splat(d, 0.125));
  return {radius * hn::IfThenElse(wide, direction.x, direction.y),
          radius * hn::IfThenElse(wide, direction.y, direction.x)};
}
template <class D>
HWY_INLINE Vec2<D> SampleDisk(D d, const Vec2<D>& u) {
  return ConcentricDisk(d, SignedSquare(d, u));
}

/// Direction around +z with density cos / pi; z > 0 always, because z^2 = (1 - r)(1 + r) loses
/// nothing.
template <class D>
HWY_INLINE Vec3<D> SampleCosineHemisphere(D d, const Vec2<D>& u) {
  const Vec2<D> s = SignedSquare(d, u);
  const Vec2<D> p = ConcentricDisk(d, s);
  const Real<D> radius = hn::Max(hn::Abs(s.x), hn::Abs(s.y));
  const Real<D> one = Splat(d, 1);
  return {p.x, p.y, hn::Sqrt((one - radius) * (one + radius))};
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
