// Fresnel terms: Schlick's with its averages, and the exact ones for dielectrics and conductors.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_BSDF_FRESNEL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_BSDF_FRESNEL_INL_H_
#undef CARPOOL_STAGES_KERNELS_BSDF_FRESNEL_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_BSDF_FRESNEL_INL_H_
#endif

#include "stages/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// (1 - cos)^5.
template <class D>
HWY_INLINE Real<D> SchlickWeight(D d, Real<D> cosine) {
  const Real<D> x = hn::Max(Splat(d, 1) - cosine, hn::Zero(d));
  const Real<D> x2 = x * x;
  return x2 * x2 * x;
}

/// Schlick 1994: F0 at normal incidence, F90 at grazing.
template <class D>
HWY_INLINE Vec3<D> SchlickFresnel(D d, const Vec3<D>& f0, Real<D> f90, Real<D> cosine) {
  const Real<D> weight = SchlickWeight(d, cosine);
  return {hn::MulAdd(f90 - f0.x, weight, f0.x), hn::MulAdd(f90 - f0.y, weight, f0.y),
          hn::MulAdd(f90 - f0.z, weight, f0.z)};
}
/// Its cosine-weighted mean over the hemisphere: the mean of (1 - cos)^5 is 1/21.
template <class D>
HWY_INLINE Real<D> SchlickAverage(D d, Real<D> f0, Real<D> f90) {
  return hn::MulAdd(f90 - f0, Splat(d, 1.0 / 21), f0);
}

/// Reflectance at normal incidence of an interface to air.
template <class D>
HWY_INLINE Real<D> NormalReflectance(D d, Real<D> ior) {
  const Real<D> ratio = (ior - Splat(d, 1)) / (ior + Splat(d, 1));
  return ratio * ratio;
}

/// F90 of a dielectric: 1 from ior 1.36 up; below, it fades so that the mean of Schlick's term
/// stays within 0.002 of the exact mean, and so that ior 1 is no interface at all.
template <class D>
HWY_INLINE Real<D> DielectricF90(D d, Real<D> ior) {
  const Real<D> faint =
      hn::Max(hn::NegMulAdd(ior - Splat(d, 1), Splat(d, 1 / 0.36), Splat(d, 1)), hn::Zero(d));
  return hn::NegMulAdd(faint, faint, Splat(d, 1));
}

/// Unpolarised reflectance of a dielectric; `eta` is the ior on the far side over the near side's.
/// Total internal reflection gives 1.
template <class D>
HWY_INLINE Real<D> FresnelDielectric(D d, Real<D> cosine, Real<D> eta) {
  const Real<D> one = Splat(d, 1);
  const Real<D> sine2 = (one - cosine) * (one + cosine);
  const Real<D> refracted2 = DifferenceOfProducts(eta, eta, sine2, one);  // (eta cos_t)^2
  const Real<D> g = SafeSqrt(d, refracted2);
  const Real<D> eta2_cosine = eta * eta * cosine;
  const Real<D> perpendicular = (cosine - g) / (cosine + g);
  const Real<D> parallel = (eta2_cosine - g) / (eta2_cosine + g);
  const Real<D> mean =
      Splat(d, 0.5) * hn::MulAdd(perpendicular, perpendicular, parallel * parallel);
  return hn::IfThenElse(hn::Gt(refracted2, hn::Zero(d)), mean, one);
}

/// Unpolarised reflectance of a conductor with complex ior eta + i k (Lagarde 2013, after Born and
/// Wolf).
template <class D>
HWY_INLINE Real<D> FresnelConductor(D d, Real<D> cosine, Real<D> eta, Real<D> k) {
  const Real<D> one = Splat(d, 1);
  const Real<D> two = Splat(d, 2);
  const Real<D> c2 = cosine * cosine;
  const Real<D> s2 = (one - cosine) * (one + cosine);
  const Real<D> t0 = eta * eta - k * k - s2;
  const Real<D> a2b2 = SafeSqrt(d, hn::MulAdd(t0, t0, Splat(d, 4) * eta * eta * k * k));
  const Real<D> a = SafeSqrt(d, Splat(d, 0.5) * (a2b2 + t0));
  const Real<D> s_sum = a2b2 + c2, s_mix = two * a * cosine;
  const Real<D> perpendicular = (s_sum - s_mix) / (s_sum + s_mix);
  const Real<D> p_sum = hn::MulAdd(c2, a2b2, s2 * s2), p_mix = s_mix * s2;
  const Real<D> parallel = perpendicular * (p_sum - p_mix) / (p_sum + p_mix);
  return Splat(d, 0.5) * (perpendicular + parallel);
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
