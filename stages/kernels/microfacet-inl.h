// The GGX microfacet distribution with height-correlated Smith shadowing, sampled by visible
// normals.
//
// Directions are in the local frame (z = shading normal). Every formula is written so that nothing
// is divided by a cosine and no 1 - cos^2 is taken: finite at grazing angles, exact to rounding at
// alpha 1e-4. Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_MICROFACET_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_MICROFACET_INL_H_
#undef CARPOOL_STAGES_KERNELS_MICROFACET_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_MICROFACET_INL_H_
#endif

#include <numbers>

#include "stages/mutants.h"
#include "stages/sampling/warp-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// sqrt(cos^2 + alpha^2 sin^2): Smith's Lambda is (this / cos - 1) / 2.
template <class D>
HWY_INLINE Real<D> SmithRoot(const Vec3<D>& w, Real<D> alpha) {
  const Real<D> across = hn::MulAdd(w.x, w.x, w.y * w.y);
  return hn::Sqrt(hn::MulAdd(alpha * alpha, across, w.z * w.z));
}

/// The smallest divisor: far below any that matters, above float's denormals. It stands for 0 / 0 =
/// 0.
constexpr double kTinyDivisor = 1e-37;

/// D(h) for a half-vector of any length (Walter et al. 2007, as ((x/a)^2 + (y/a)^2 + z^2)^-2 / (pi
/// a^2)); 0 for a half-vector too short to have a direction.
template <class D>
HWY_INLINE Real<D> GgxDistribution(D d, const Vec3<D>& half, Real<D> length2,
                                   Real<D> inverse_alpha) {
  const Real<D> x = half.x * inverse_alpha;
  const Real<D> y = half.y * inverse_alpha;
  Real<D> q = hn::MulAdd(x, x, hn::MulAdd(y, y, half.z * half.z));
  if (IsMutant(Mutant::naive_ggx)) {
    const Real<D> cos2 = SafeDiv(d, half.z * half.z, length2);
    q = length2 * hn::MulAdd((Splat(d, 1) - cos2) * inverse_alpha, inverse_alpha, cos2);
  }
  const Real<D> ratio = length2 / hn::Max(q, Splat(d, kTinyDivisor)) * inverse_alpha;
  return ratio * ratio * Splat(d, 1 / std::numbers::pi);
}

/// G1(wo) / (4 wo.z): times D(h), the density of `wi` when its half-vector is drawn by
/// SampleVisibleNormal.
template <class D>
HWY_INLINE Real<D> VisibleNormalScale(D d, const Vec3<D>& wo, Real<D> root_o) {
  return Splat(d, 0.5) / (wo.z + root_o);
}

/// G2 / (4 wo.z): times D(h), the microfacet BRDF times wi.z >= 0 without its Fresnel term; G2 is
/// Smith's height-correlated shadowing (Heitz 2014, eq. 99).
template <class D>
HWY_INLINE Real<D> MicrofacetScale(D d, const Vec3<D>& wo, Real<D> cosine_i, Real<D> root_o,
                                   Real<D> root_i) {
  const Real<D> joint = hn::MulAdd(cosine_i, root_o, wo.z * root_i);
  return Splat(d, 0.5) * cosine_i / hn::Max(joint, Splat(d, kTinyDivisor));
}

/// A microfacet normal as seen from `wo`, unit length (Dupuy and Benyoub 2023, "Sampling Visible
/// GGX Normals with Spherical Caps").
template <class D>
HWY_INLINE Vec3<D> SampleVisibleNormal(D d, const Vec3<D>& wo, Real<D> alpha, const Vec2<D>& u) {
  const Vec3<D> stretched = Normalize<D>(d, {wo.x * alpha, wo.y * alpha, wo.z});
  // The cap reaches from the pole, z = 1, down to z = -stretched.z; heights are measured from its
  // ends.
  const Real<D> whole = Splat(d, 1) + stretched.z;
  const Real<D> below_pole = u.y * whole;
  const Real<D> sine = SafeSqrt(d, below_pole * (Splat(d, 2) - below_pole));
  const Vec2<D> turn = CosSinTurns(d, u.x);
  const Vec3<D> half{hn::MulAdd(sine, turn.x, stretched.x), hn::MulAdd(sine, turn.y, stretched.y),
                     (Splat(d, 1) - u.y) * whole};
  return Normalize<D>(d, {half.x * alpha, half.y * alpha, half.z});
}

/// Mirror image of wo about a unit normal.
template <class D>
HWY_INLINE Vec3<D> Reflect(const Vec3<D>& wo, const Vec3<D>& normal) {
  const Real<D> twice = Dot(wo, normal) + Dot(wo, normal);
  return {hn::MulSub(normal.x, twice, wo.x), hn::MulSub(normal.y, twice, wo.y),
          hn::MulSub(normal.z, twice, wo.z)};
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
