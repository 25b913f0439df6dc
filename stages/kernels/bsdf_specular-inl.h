// The GGX reflection lobe: single scattering with Schlick's Fresnel term.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_BSDF_SPECULAR_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_BSDF_SPECULAR_INL_H_
#undef CARPOOL_STAGES_KERNELS_BSDF_SPECULAR_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_BSDF_SPECULAR_INL_H_
#endif

#include "stages/kernels/bsdf_fresnel-inl.h"
#include "stages/kernels/bsdf_lobes-inl.h"
#include "stages/kernels/microfacet-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

template <class D>
struct SpecularLobe {
  Real<D> weight;
  Real<D> alpha, inverse_alpha;
  Real<D> root_o;     // SmithRoot of wo
  Real<D> pdf_scale;  // VisibleNormalScale of wo
  Vec3<D> f0;
  Real<D> f90;

  HWY_INLINE void SetOutgoing(D d, Real<D> alpha_value, const Vec3<D>& wo) {
    alpha = alpha_value;
    inverse_alpha = Splat(d, 1) / alpha;
    root_o = SmithRoot<D>(wo, alpha);
    pdf_scale = VisibleNormalScale<D>(d, wo, root_o);
  }

  HWY_INLINE Vec3<D> Sample(D d, const Vec3<D>& wo, const Vec2<D>& u) const {
    return Reflect<D>(wo, SampleVisibleNormal<D>(d, wo, alpha, u));
  }

  HWY_INLINE void Evaluate(D d, const DirectionPair<D>& pair, LobeSum<D>& sum) const {
    if (hn::AllFalse(d, hn::Gt(weight, hn::Zero(d)))) return;
    const Real<D> distribution = hn::IfThenElseZero(
        pair.reflected, GgxDistribution<D>(d, pair.half, pair.length2, inverse_alpha));
    const Real<D> root_i = SmithRoot<D>(pair.wi, alpha);
    const Real<D> value =
        distribution * sum.below * MicrofacetScale<D>(d, pair.wo, pair.cosine, root_o, root_i);
    sum.f_cos = MulAdd<D>(SchlickFresnel<D>(d, f0, f90, pair.half_cosine), value, sum.f_cos);
    sum.weighted_pdf = hn::MulAdd(weight * pdf_scale, distribution, sum.weighted_pdf);
  }
};

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
