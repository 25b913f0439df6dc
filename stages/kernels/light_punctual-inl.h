// Point, spot and directional lights, with the fall-off that KHR_lights_punctual describes.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_LIGHT_PUNCTUAL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_LIGHT_PUNCTUAL_INL_H_
#undef CARPOOL_STAGES_KERNELS_LIGHT_PUNCTUAL_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_LIGHT_PUNCTUAL_INL_H_
#endif

#include <cstddef>

#include "stages/kernels/light_math-inl.h"
#include "stages/simd/quads-inl.h"
#include "stages/tables/light_view.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {
namespace lights {

constexpr double kFarAway = 1e30;  // distance of what is infinitely far

template <class D>
struct PunctualSample {
  Vec3<D> wi;          // unit, from the receiver
  Real<D> distance;    // kFarAway for directional lights
  Vec3<D> irradiance;  // on a surface that faces wi; 0 out of range, outside the cone, on the light
};

/// KHR_lights_punctual, "Range Property": max(min(1 - (d / range)^4, 1), 0) / d^2; range 0 is
/// infinite.
template <class D>
HWY_INLINE Real<D> DistanceFactor(D d, Real<D> distance, Real<D> range) {
  const Real<D> relative = SafeDiv(d, distance, range), squared = relative * relative;
  const Real<D> window = hn::Max(hn::NegMulAdd(squared, squared, Splat(d, 1)), hn::Zero(d));
  const Real<D> distance2 = distance * distance;
  return hn::IfThenElseZero(hn::Gt(distance2, Splat(d, 1e-30)), SafeDiv(d, window, distance2));
}

/// KHR_lights_punctual, "Inner and Outer Cone Angles". `cos` is between the spot's axis and the
/// ray.
template <class D>
HWY_INLINE Real<D> ConeFactor(D d, Real<D> cos, Real<D> cos_inner, Real<D> cos_outer) {
  const Real<D> width = hn::Max(cos_inner - cos_outer, Splat(d, 0.001));
  const Real<D> inside = hn::Max((cos - cos_outer) / width, hn::Zero(d));
  const Real<D> factor = hn::Min(inside, Splat(d, 1));
  return factor * factor;
}

/// `light` must be a point, spot or directional light in every lane that is used.
template <class D>
HWY_INLINE PunctualSample<D> SamplePunctual(D d, const Light* lights, Int<D> light,
                                            const Vec3<D>& ref) {
  const IntTag<D> di;
  const Int<D> type = FieldInt(d, lights, light, offsetof(Light, type));
  const Quad<D> place =
      FieldQuad(d, lights, light, offsetof(Light, punctual.position));  // and range
  const Quad<D> aim =
      FieldQuad(d, lights, light, offsetof(Light, punctual.direction));  // and cos_inner
  const Quad<D> power =
      FieldQuad(d, lights, light, offsetof(Light, punctual.intensity));  // and cos_outer
  const auto is = [&](LightType wanted) HWY_ATTR {
    return ToMask(d, hn::Eq(type, hn::Set(di, static_cast<int32_t>(wanted))));
  };
  const Mask<D> directional = is(LightType::directional), spot = is(LightType::spot);
  const Vec3<D> axis = {aim.x, aim.y, aim.z};
  const Vec3<D> to_light = Sub<D>({place.x, place.y, place.z}, ref);
  const Real<D> distance = SafeSqrt(d, Dot(to_light, to_light));
  const Vec3<D> wi =
      Select<D>(directional, Neg<D>(axis), Scale(to_light, SafeDiv(d, Splat(d, 1), distance)));

  Real<D> factor = DistanceFactor(d, distance, place.w);
  if (!hn::AllFalse(d, spot)) {
    const Real<D> cone = ConeFactor(d, hn::Neg(Dot(axis, wi)), aim.w, power.w);
    factor = hn::IfThenElse(spot, factor * cone, factor);
  }
  factor = hn::IfThenElse(directional, Splat(d, 1), factor);
  return {wi, hn::IfThenElse(directional, Splat(d, kFarAway), distance),
          Scale(Vec3<D>{power.x, power.y, power.z}, factor)};
}

}  // namespace lights

using lights::PunctualSample;
using lights::SamplePunctual;

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
