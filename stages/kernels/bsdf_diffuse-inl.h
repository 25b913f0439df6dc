// The diffuse base under a dielectric interface, layered by albedo scaling.
//
// f = base / pi (1 - E(wo)) (1 - E(wi)) / (1 - E_avg), E the interface's directional albedo with
// all its bounces (Kelemen and Szirmay-Kalos 2001): reciprocal, and a white base under any
// interface returns all light to the tables' residual. Per-target header: see
// stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_BSDF_DIFFUSE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_BSDF_DIFFUSE_INL_H_
#undef CARPOOL_STAGES_KERNELS_BSDF_DIFFUSE_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_BSDF_DIFFUSE_INL_H_
#endif

#include <numbers>

#include "stages/kernels/bsdf_lobes-inl.h"
#include "stages/mutants.h"
#include "stages/sampling/warp-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

template <class D>
struct DiffuseLobe {
  Real<D> weight;
  Vec3<D> diffuse;                        // base (1 - E(wo)) / (1 - E_avg)
  Real<D> through, through_m, through_b;  // 1 - E = through - through_m M - through_b B

  HWY_INLINE Vec3<D> Sample(D d, const Vec3<D>&, const Vec2<D>& u) const {
    return SampleCosineHemisphere(d, u);
  }

  HWY_INLINE void Evaluate(D d, const DirectionPair<D>& pair, LobeSum<D>& sum) const {
    if (hn::AllFalse(d, hn::Gt(weight, hn::Zero(d)))) return;
    const Real<D> pdf = pair.cosine * Splat(d, 1 / std::numbers::pi);
    const Real<D> f_cos = IsMutant(Mutant::missing_cosine) ? Splat(d, 1 / std::numbers::pi) : pdf;
    sum.f_cos = MulAdd<D>(diffuse, f_cos * sum.below * Passed(d, pair.albedo), sum.f_cos);
    sum.weighted_pdf = hn::MulAdd(weight, pdf, sum.weighted_pdf);
  }

  /// 1 - E: what the interface lets through at the angle of these albedos.
  HWY_INLINE Real<D> Passed(D d, const AlbedoAt<D>& at) const {
    const Real<D> passed = hn::NegMulAdd(through_m, at.m, hn::NegMulAdd(through_b, at.b, through));
    return hn::Max(passed, hn::Zero(d));
  }
};

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
