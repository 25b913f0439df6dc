// The cosine-sampled lobe: diffuse under a dielectric interface, and the specular lobe's further bounces.
//
// Per-target header: see stages/simd/lanes-inl.h. Both parts are products g(wo) g(wi) of albedo tables, so
// both are reciprocal, and both conserve energy to the table's residual:
//   diffuse: base / pi (1 - E(wo)) (1 - E(wi)) / (1 - E_avg), E the dielectric's albedo (albedo scaling,
//            Kelemen and Szirmay-Kalos 2001);
//   further bounces: share / pi M(wo) M(wi) / M_avg (Kulla and Conty 2017).

#if defined(CARPOOL_STAGES_KERNELS_BSDF_COSINE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_BSDF_COSINE_INL_H_
#undef CARPOOL_STAGES_KERNELS_BSDF_COSINE_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_BSDF_COSINE_INL_H_
#endif

#include <numbers>

#include "stages/kernels/bsdf_albedo-inl.h"
#include "stages/kernels/bsdf_lobes-inl.h"
#include "stages/sampling/warp-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

template <class D>
struct CosineLobe {
  Real<D> weight;
  BsdfTablesView tables;
  AlbedoRow<D> row;
  Vec3<D> diffuse;  // base (1 - E(wo)) / (1 - E_avg)
  Vec3<D> multi;    // share M(wo) / M_avg
  Real<D> through, through_m, through_b;  // 1 - E(wi) = through - through_m M(wi) - through_b B(wi)

  HWY_INLINE Vec3<D> Sample(D d, const Vec3<D>&, const Vec2<D>& u) const {
    return SampleCosineHemisphere(d, u);
  }

  HWY_INLINE void Evaluate(D d, const DirectionPair<D>& pair, LobeSum<D>& sum) const {
    const Mask<D> active = hn::And(pair.reflected, hn::Gt(weight, hn::Zero(d)));
    if (hn::AllFalse(d, active)) return;
    const Real<D> pdf = hn::IfThenElseZero(active, pair.wi.z * Splat(d, 1 / std::numbers::pi));
    const AlbedoAt<D> albedo = LookUpAlbedo<D>(d, tables, row, hn::Max(pair.wi.z, hn::Zero(d)));
    const Real<D> passed = Passed(d, albedo);
    const Real<D> value = pdf * sum.below;
    sum.f_cos = MulAdd<D>(MulAdd<D>(diffuse, passed, Scale<D>(multi, albedo.m)), value, sum.f_cos);
    sum.weighted_pdf = hn::MulAdd(weight, pdf, sum.weighted_pdf);
  }

  /// 1 - E: what the interface lets through to the diffuse base, of light at an angle of this albedo.
  HWY_INLINE Real<D> Passed(D d, const AlbedoAt<D>& at) const {
    const Real<D> passed = hn::NegMulAdd(through_m, at.m, hn::NegMulAdd(through_b, at.b, through));
    return hn::Max(passed, hn::Zero(d));
  }
};

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
