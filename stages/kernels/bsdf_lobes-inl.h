// What a BSDF lobe is, and the set of lobes that a material is made of.
//
// Per-target header: see stages/simd/lanes-inl.h. A lobe is a struct template over D with
//
//   Real<D> weight;   its directional albedo at wo, summed over RGB: how often it is sampled
//   Vec3<D> Sample(d, wo, u)  a direction drawn by this lobe's own density, for lanes that chose it
//   void Evaluate(d, pair, sum)  adds f cos (times sum.below) and weight x pdf, both zero in lanes
//   whose
//                                pair it does not connect; a covering lobe then scales sum.below
//
// A lobe whose weight is zero in a lane must add nothing there.

#if defined(CARPOOL_STAGES_KERNELS_BSDF_LOBES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_BSDF_LOBES_INL_H_
#undef CARPOOL_STAGES_KERNELS_BSDF_LOBES_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_BSDF_LOBES_INL_H_
#endif

#include "stages/kernels/bsdf_albedo-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// A pair of directions, and what several lobes need of it.
template <class D>
struct DirectionPair {
  Vec3<D> wo, wi;
  Mask<D> reflected;    // wi is above the surface, as wo is
  Real<D> cosine;       // of wi, zero in other lanes
  Vec3<D> half;         // wo + wi, not normalised
  Real<D> length2;      // of `half`
  Real<D> half_cosine;  // between the half-vector and either direction
  AlbedoAt<D> albedo;   // at wi for the base's roughness; zero where no lobe uses it
};

template <class D>
HWY_INLINE DirectionPair<D> MakePair(D d, const Vec3<D>& wo, const Vec3<D>& wi) {
  const Vec3<D> half = Add<D>(wo, wi);
  const Real<D> length2 = Dot<D>(half, half);
  const Mask<D> reflected = hn::Gt(wi.z, hn::Zero(d));
  return {wo,
          wi,
          reflected,
          hn::IfThenElseZero(reflected, wi.z),
          half,
          length2,
          hn::Sqrt(length2) * Splat(d, 0.5),
          {hn::Zero(d), hn::Zero(d)}};
}

/// The running sum of EvaluateBsdf, from the top lobe down.
template <class D>
struct LobeSum {
  Vec3<D> f_cos;
  Real<D> weighted_pdf;
  Real<D> below;  // what the lobes so far let through, both ways
};

template <class D>
struct BsdfValue {
  Vec3<D> f_cos;  // BSDF times |cos wi|
  Real<D> pdf;    // of SampleBsdf, solid angle
};

template <class D>
struct BsdfSample {
  Vec3<D> wi;
  Vec3<D> weight;  // f cos / pdf
  Real<D> pdf;
  Mask<D> valid;  // otherwise the path ends: weight and pdf are zero, wi is some unit vector
};

/// The lobes of one material, from the top down. Sampling picks one lobe by weight; the density is
/// always that of the whole mixture, so that light sampling and BSDF sampling agree on it.
template <class D, template <class> class... Lobes>
struct LobeSet : Lobes<D>... {
  Real<D> total_weight, inverse_total;

  /// Call once the lobes' weights are set.
  HWY_INLINE void SumWeights(D d) {
    total_weight = hn::Zero(d);
    ((total_weight = total_weight + Lobes<D>::weight), ...);
    inverse_total = SafeDiv(d, Splat(d, 1), total_weight);
  }

  HWY_INLINE BsdfValue<D> Evaluate(D d, const DirectionPair<D>& pair) const {
    LobeSum<D> sum{Splat3(d, 0, 0, 0), hn::Zero(d), Splat(d, 1)};
    (Lobes<D>::Evaluate(d, pair, sum), ...);
    return {sum.f_cos, sum.weighted_pdf * inverse_total};
  }

  /// A lane's lobe is the first whose running sum of weights exceeds u_lobe times their total. As
  /// u_lobe <= 1 - 2^-24, the product rounds to less than the total: some lobe of positive weight
  /// is always chosen, unless all are zero.
  HWY_INLINE Vec3<D> Sample(D d, const Vec3<D>& wo, Real<D> u_lobe, const Vec2<D>& u) const {
    const Real<D> target = u_lobe * total_weight;
    Real<D> running = hn::Zero(d);
    Vec3<D> wi = Splat3(d, 0, 0, 1);
    (SampleIfChosen<Lobes<D>>(d, target, running, wo, u, wi), ...);
    return wi;
  }

  /// The number, from the top, of the lobe that Sample takes for u_lobe in the first lane; -1:
  /// none.
  HWY_INLINE int32_t ChosenLobe(D, Real<D> u_lobe) const {
    const auto target = hn::GetLane(u_lobe * total_weight);
    auto running = hn::GetLane(hn::Zero(D()));
    int32_t chosen = -1, number = 0;
    const auto visit = [&](Real<D> weight) HWY_ATTR {
      const auto next = running + hn::GetLane(weight);
      if (target >= running && target < next) chosen = number;
      running = next;
      ++number;
    };
    (visit(Lobes<D>::weight), ...);
    return chosen;
  }

 private:
  template <class Lobe>
  HWY_INLINE void SampleIfChosen(D d, Real<D> target, Real<D>& running, const Vec3<D>& wo,
                                 const Vec2<D>& u, Vec3<D>& wi) const {
    const Real<D> next = running + Lobe::weight;
    const Mask<D> chosen = hn::And(hn::Ge(target, running), hn::Lt(target, next));
    running = next;
    if (hn::AllFalse(d, chosen)) return;
    wi = Select<D>(chosen, Lobe::Sample(d, wo, u), wi);
  }
};

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
