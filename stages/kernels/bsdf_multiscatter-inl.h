// Light that leaves the GGX lobe after more than one bounce between microfacets.
//
// f = share / pi M(wo) M(wi) / M_avg (Kulla and Conty 2017): reciprocal, and it returns exactly
// what single scattering loses. M lies at mu ~ alpha, where a cosine-weighted direction almost
// never goes; directions therefore follow mu / (mu^2 + b) with b ~ alpha^2, which bounds f cos /
// pdf. Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_BSDF_MULTISCATTER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_BSDF_MULTISCATTER_INL_H_
#undef CARPOOL_STAGES_KERNELS_BSDF_MULTISCATTER_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_BSDF_MULTISCATTER_INL_H_
#endif

#include <numbers>

#include "stages/kernels/bsdf_lobes-inl.h"
#include "stages/sampling/warp-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

template <class D>
struct MultiScatterLobe {
  Real<D> weight;
  Vec3<D> multi;           // share M(wo) / M_avg
  Real<D> log2_spread;     // log2(1 + 1 / b)
  Real<D> natural_spread;  // log(1 + 1 / b)
  Real<D> spread;          // b

  /// 1 / b from its logarithm by the function that Sample inverts, so that both agree to the last
  /// bits.
  HWY_INLINE void SetSpread(D d, Real<D> log2) {
    log2_spread = log2;
    natural_spread = log2 * Splat(d, std::numbers::ln2);
    spread = Splat(d, 1) / Exp2Minus1(d, log2);
  }

  /// mu^2 = b ((1 + 1/b)^u - 1), the inverse of log(1 + mu^2 / b) / log(1 + 1 / b).
  HWY_INLINE Vec3<D> Sample(D d, const Vec3<D>&, const Vec2<D>& u) const {
    const Real<D> centred = u.y + Splat(d, 0x1p-25);  // never 0, so neither is mu
    const Real<D> mu2 = hn::Min(spread * Exp2Minus1(d, centred * log2_spread), Splat(d, 1));
    const Real<D> sine = hn::Sqrt(Splat(d, 1) - mu2);
    const Vec2<D> turn = CosSinTurns(d, u.x);
    return {sine * turn.x, sine * turn.y, hn::Sqrt(mu2)};
  }

  HWY_INLINE void Evaluate(D d, const DirectionPair<D>& pair, LobeSum<D>& sum) const {
    if (hn::AllFalse(d, hn::Gt(weight, hn::Zero(d)))) return;
    const Real<D> cosine = pair.cosine * Splat(d, 1 / std::numbers::pi);
    sum.f_cos = MulAdd<D>(multi, cosine * sum.below * pair.albedo.m, sum.f_cos);
    const Real<D> mass = hn::MulAdd(pair.cosine, pair.cosine, spread) * natural_spread;
    sum.weighted_pdf = hn::MulAdd(weight, cosine / mass, sum.weighted_pdf);
  }
};

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
