// Next-event estimation's one call: chooses a light for each receiver and a direction towards it.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_LIGHT_SAMPLE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_LIGHT_SAMPLE_INL_H_
#undef CARPOOL_STAGES_KERNELS_LIGHT_SAMPLE_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_LIGHT_SAMPLE_INL_H_
#endif

#include <cstddef>

#include "stages/kernels/environment-inl.h"
#include "stages/kernels/light_punctual-inl.h"
#include "stages/kernels/light_tree-inl.h"
#include "stages/kernels/light_triangle-inl.h"
#include "stages/kernels/triangle-inl.h"
#include "stages/tables/light_view.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {
namespace lights {

template <class D>
struct LightSample {
  Vec3<D> wi;        // unit, from the receiver
  Real<D> distance;  // to the light; kFarAway where it is infinitely far
  /// environment and triangle: radiance; punctual: irradiance on a surface facing `wi`.
  Vec3<D> radiance_or_irradiance;
  Mask<D> varies;  // triangle: that is 1, to be multiplied by the emission at (b1, b2)
  Real<D> pdf;     // per solid angle (1 for delta lights) x selection; 0: no sample
  Mask<D> delta;   // punctual: no other way of finding the light
  Int<D> light;    // kNone: the environment, or no sample
  Real<D> b1, b2;  // triangle: barycentrics of p1 and p2
  Real<D> blur;    // triangle: relative error of the distance at which rays find it
};

/// The kind of light that each lane's number falls to, in the order tree, infinite, environment.
template <class D>
struct KindChoice {
  Mask<D> tree, infinite, environment;
  Real<D> u_remapped;
};

template <class D>
HWY_INLINE KindChoice<D> ChooseKind(D d, const LightView& view, Mask<D> active, Real<D> u) {
  const bool has_environment = view.environment_probability > 0;
  const bool has_infinite = view.infinite_count > 0 && view.infinite_probability > 0;
  const float infinite = has_infinite ? view.infinite_probability * view.infinite_count : 0;
  // Rounding may leave the sum a little below 1: the last kind that is present takes the rest.
  const float tree_end = has_infinite || has_environment ? view.tree_probability : 2.0f;
  const float infinite_end = has_environment ? view.tree_probability + infinite : 2.0f;
  const Mask<D> below_tree = hn::Lt(u, Splat(d, tree_end));
  const Mask<D> below_infinite = hn::Lt(u, Splat(d, infinite_end));
  const Mask<D> second = hn::AndNot(below_tree, below_infinite);

  const Real<D> in_tree = SafeDiv(d, u, Splat(d, view.tree_probability));
  const Real<D> in_infinite = SafeDiv(d, u - Splat(d, view.tree_probability), Splat(d, infinite));
  return {hn::And(active, below_tree), hn::And(active, second),
          hn::AndNot(hn::Or(below_tree, below_infinite), active),
          hn::Min(hn::IfThenElse(second, in_infinite, in_tree), Splat(d, kLargestBelowOne))};
}

/// Lanes of `m` from `b`, the others from `a`.
template <class D>
HWY_INLINE LightSample<D> Merge(D d, Mask<D> m, const LightSample<D>& a, const LightSample<D>& b) {
  return {Select<D>(m, b.wi, a.wi),
          hn::IfThenElse(m, b.distance, a.distance),
          Select<D>(m, b.radiance_or_irradiance, a.radiance_or_irradiance),
          hn::Or(hn::AndNot(m, a.varies), hn::And(m, b.varies)),
          hn::IfThenElse(m, b.pdf, a.pdf),
          hn::Or(hn::AndNot(m, a.delta), hn::And(m, b.delta)),
          hn::IfThenElse(ToIntMask(d, m), b.light, a.light),
          hn::IfThenElse(m, b.b1, a.b1),
          hn::IfThenElse(m, b.b2, a.b2),
          hn::IfThenElse(m, b.blur, a.blur)};
}

template <class D>
HWY_INLINE LightSample<D> NoLight(D d) {
  const Real<D> zero = hn::Zero(d);
  const Mask<D> never = hn::Lt(zero, zero);
  const Int<D> none = hn::Set(IntTag<D>(), kNone);
  return {Splat3(d, 0, 0, 1), zero, Splat3(d, 0, 0, 0), never, zero, never, none, zero, zero, zero};
}

/// What kind of light it is, and which triangle.
template <class D>
struct LightName {
  Mask<D> triangle, two_sided, mirrored;
  Int<D> placement, primitive;  // meaningless unless it is a triangle
};
template <class D>
HWY_INLINE LightName<D> LoadLightName(D d, const LightView& view, Int<D> light) {
  const IntTag<D> di;
  const IntQuad<D> q = FieldIntQuad(d, view.lights, light, offsetof(Light, type));
  const auto is = [&](LightType wanted) HWY_ATTR {
    return ToMask(d, hn::Eq(q.x, hn::Set(di, static_cast<int32_t>(wanted))));
  };
  return {ToMask(d, hn::Lt(q.x, hn::Set(di, static_cast<int32_t>(kLastTriangleType) + 1))),
          is(LightType::two_sided_triangle), is(LightType::mirrored_triangle), q.y, q.z};
}
static_assert(offsetof(Light, placement) == offsetof(Light, type) + 4 &&
              offsetof(Light, primitive) == offsetof(Light, type) + 8);

/// `pdf` of the result has no selection in it. A light with one side gives nothing behind it.
template <class D>
HWY_INLINE LightSample<D> FromTriangle(D d, const LightView& view, Int<D> light,
                                       const LightName<D>& name, const Vec3<D>& ref,
                                       const Vec2<D>& u) {
  const Quad<D> a = FieldQuad(d, view.lights, light, offsetof(Light, triangle.p0));
  const Quad<D> b = FieldQuad(d, view.lights, light, offsetof(Light, triangle.p1));
  const Quad<D> c = FieldQuad(d, view.lights, light, offsetof(Light, triangle.p2));
  const Triangle<D> triangle = {{a.x, a.y, a.z}, {b.x, b.y, b.z}, {c.x, c.y, c.z}, name.mirrored};
  const TriangleLightSample<D> s =
      SampleTriangleLight(d, triangle.p0, triangle.p1, triangle.p2, ref, u);
  const Mask<D> behind =
      hn::Ge(Dot(TriangleAreaNormal<D>(triangle), Sub<D>(triangle.p0, ref)), hn::Zero(d));
  LightSample<D> sample = NoLight(d);
  sample.wi = s.wi;
  sample.distance = s.distance;
  sample.varies = hn::Lt(a.w, hn::Zero(d));
  sample.radiance_or_irradiance =
      Select<D>(sample.varies, Splat3(d, 1, 1, 1), Vec3<D>{a.w, b.w, c.w});
  sample.pdf = hn::IfThenZeroElse(hn::AndNot(name.two_sided, behind), s.pdf);
  sample.light = light;
  sample.b1 = s.b1;
  sample.b2 = s.b2;
  sample.blur = s.blur;
  return sample;
}

/// `pdf` of the result has no selection in it.
template <class D>
HWY_INLINE LightSample<D> FromPunctual(D d, const LightView& view, Int<D> light,
                                       const Vec3<D>& ref) {
  const PunctualSample<D> s = SamplePunctual(d, view.lights, light, ref);
  const Real<D> zero = hn::Zero(d);
  LightSample<D> sample = NoLight(d);
  sample.wi = s.wi;
  sample.distance = s.distance;
  sample.radiance_or_irradiance = s.irradiance;
  sample.pdf = hn::IfThenElseZero(hn::Gt(MaxComponent<D>(s.irradiance), zero), Splat(d, 1));
  sample.delta = hn::Eq(zero, zero);
  sample.light = light;
  return sample;
}

template <class D>
HWY_INLINE LightSample<D> FromEnvironment(D d, const LightView& view,
                                          const EnvironmentSearch<D>& search) {
  const EnvironmentSample<D> s = SampleFound(d, view.environment, search);
  LightSample<D> sample = NoLight(d);
  sample.wi = s.dir;
  sample.distance = Splat(d, kFarAway);
  sample.radiance_or_irradiance = s.radiance;
  sample.pdf = s.pdf * Splat(d, view.environment_probability);
  return sample;
}

/// Which light each lane shall sample, while it is being chosen, and where on the environment.
template <class D>
struct LightChoice {
  KindChoice<D> kind;
  Vec2<D> u;                    // for the place on the light
  Descent<D> descent;           // of the lanes whose kind is the tree
  EnvironmentSearch<D> search;  // of those whose kind is the environment
  int steps;                    // of the search that are still to be done
};

/// Begins to choose; `normal` is unit length on the side that takes light, or zero for a receiver
/// that takes it from all sides. `IsChosen` says when it is done, `ChooseOn` goes on.
template <class D>
HWY_INLINE void BeginChoice(D d, const LightView& view, Mask<D> active, const Vec3<D>& position,
                            const Vec3<D>& normal, Real<D> u_pick, const Vec2<D>& u,
                            LightChoice<D>& choice) {
  choice.kind = ChooseKind(d, view, active, u_pick);
  choice.u = u;
  choice.descent =
      StartDescent(d, view, choice.kind.tree, position, normal, choice.kind.u_remapped);
  choice.steps = hn::AllFalse(d, choice.kind.environment) ? 0 : 2;
  if (choice.steps > 0) FindRow(d, view.environment, u, choice.search);
}
template <class D>
HWY_INLINE bool IsChosen(D d, const LightChoice<D>& choice) {
  return choice.steps == 0 && hn::AllFalse(d, choice.descent.active);
}
template <class D>
HWY_INLINE void ChooseOn(D d, const LightView& view, LightChoice<D>& choice) {
  if (choice.steps == 2) FindColumn(d, view.environment, choice.u, choice.search);
  if (choice.steps == 1) FindPlace(d, view.environment, choice.u, choice.search);
  choice.steps = choice.steps > 0 ? choice.steps - 1 : 0;
  if (!hn::AllFalse(d, choice.descent.active)) Descend(d, view, choice.descent);
}

/// What was chosen, from the tree or from the infinite lights.
template <class D>
HWY_INLINE LightPick<D> PickOf(D d, const LightView& view, const LightChoice<D>& choice) {
  const KindChoice<D>& kind = choice.kind;
  LightPick<D> pick = choice.descent.pick;
  pick.probability = pick.probability * Splat(d, view.tree_probability);
  if (!hn::AllFalse(d, kind.infinite)) {
    const IntTag<D> di;
    const Int<D> which =
        hn::ConvertTo(di, kind.u_remapped * Splat(d, static_cast<double>(view.infinite_count)));
    const Int<D> last = hn::Set(di, view.infinite_count - 1);
    const Int<D> light =
        GatherInt(d, view.infinite_lights, hn::Min(hn::Max(which, hn::Zero(di)), last));
    pick.light = hn::IfThenElse(ToIntMask(d, kind.infinite), light, pick.light);
    pick.probability =
        hn::IfThenElse(kind.infinite, Splat(d, view.infinite_probability), pick.probability);
  }
  return pick;
}

/// One sample of the light that was chosen for each active receiver.
template <class D>
HWY_INLINE LightSample<D> SampleChosen(D d, const LightView& view, Mask<D> active,
                                       const LightChoice<D>& choice, const Vec3<D>& position) {
  LightSample<D> sample = NoLight(d);
  if (!HasLights(view)) return sample;
  const Mask<D> environment = choice.kind.environment;
  if (!hn::AllFalse(d, environment)) {
    sample = Merge(d, environment, sample, FromEnvironment(d, view, choice.search));
  }
  const LightPick<D> pick = PickOf(d, view, choice);
  const IntTag<D> di;
  const auto picked = hn::Gt(pick.light, hn::Set(di, kNone));
  const Mask<D> has_light = hn::AndNot(environment, hn::And(active, ToMask(d, picked)));
  if (hn::AllFalse(d, has_light)) return sample;

  const Int<D> light = hn::IfThenElseZero(ToIntMask(d, has_light), pick.light);
  const LightName<D> name = LoadLightName(d, view, light);
  const Mask<D> triangle = hn::And(has_light, name.triangle);
  const Mask<D> punctual = hn::AndNot(triangle, has_light);
  if (!hn::AllFalse(d, triangle)) {
    sample = Merge(d, triangle, sample, FromTriangle(d, view, light, name, position, choice.u));
  }
  if (!hn::AllFalse(d, punctual)) {
    sample = Merge(d, punctual, sample, FromPunctual(d, view, light, position));
  }
  sample.pdf = hn::IfThenElse(has_light, sample.pdf * pick.probability, sample.pdf);
  return sample;
}

/// All at once: one sample of all light that may reach each active receiver.
template <class D>
HWY_INLINE LightSample<D> SampleLight(D d, const LightView& view, Mask<D> active,
                                      const Vec3<D>& position, const Vec3<D>& normal,
                                      Real<D> u_pick, const Vec2<D>& u) {
  LightChoice<D> choice;
  BeginChoice(d, view, active, position, normal, u_pick, u, choice);
  while (!IsChosen(d, choice)) ChooseOn(d, view, choice);
  return SampleChosen(d, view, active, choice, position);
}

/// Density with which `SampleLight` at `position` returns the point of the triangle light `light`
/// that lies at `distance` along the unit `wi`; all else as it was given there.
template <class D>
HWY_INLINE Real<D> LightPdfForTriangleHit(D d, const LightView& view, Mask<D> active,
                                          const Vec3<D>& position, const Vec3<D>& normal,
                                          Int<D> light, const Vec3<D>& p0, const Vec3<D>& p1,
                                          const Vec3<D>& p2, const Vec3<D>& wi, Real<D> distance) {
  if (view.tree_probability <= 0 || hn::AllFalse(d, active)) return hn::Zero(d);
  const Real<D> selection = PickProbability(d, view, active, position, normal, light);
  return Splat(d, view.tree_probability) * selection *
         TriangleLightPdf(d, p0, p1, p2, position, wi, distance);
}

/// Density with which `SampleLight` returns the unit direction `dir` by way of the environment.
template <class D>
HWY_INLINE Real<D> LightPdfForEnvironment(D d, const LightView& view, const Vec3<D>& dir) {
  if (view.environment_probability <= 0) return hn::Zero(d);
  return EnvironmentPdf(d, view.environment, dir) * Splat(d, view.environment_probability);
}

}  // namespace lights

using lights::LightPdfForEnvironment;
using lights::LightPdfForTriangleHit;
using lights::LightSample;
using lights::SampleLight;

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
