// Feeds queries to the kernels lane by lane and collects what they return.
#include "tests/stages/light_harness.h"

#include <algorithm>
#include <cstddef>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/stages/light_harness.cpp"
#include "hwy/foreach_target.h"

#include "stages/kernels/light_sample-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// One vector's worth of queries, transposed into lanes.
template <class D>
struct LaneQuery {
  Vec3<D> position, normal, dir, p0, p1, p2;
  Real<D> distance, u_pick;
  Vec2<D> u;
  Int<D> light, placement, primitive;
};

template <class D>
LaneQuery<D> LoadQueries(D d, const LightQuery* queries, Int<D> i) {
  return {FieldVec3(d, queries, i, offsetof(LightQuery, position)),
          FieldVec3(d, queries, i, offsetof(LightQuery, normal)),
          FieldVec3(d, queries, i, offsetof(LightQuery, dir)),
          FieldVec3(d, queries, i, offsetof(LightQuery, p)),
          FieldVec3(d, queries, i, offsetof(LightQuery, p) + 12),
          FieldVec3(d, queries, i, offsetof(LightQuery, p) + 24),
          FieldReal(d, queries, i, offsetof(LightQuery, distance)),
          FieldReal(d, queries, i, offsetof(LightQuery, u_pick)),
          {FieldReal(d, queries, i, offsetof(LightQuery, u)),
           FieldReal(d, queries, i, offsetof(LightQuery, u) + 4)},
          FieldInt(d, queries, i, offsetof(LightQuery, light)),
          FieldInt(d, queries, i, offsetof(LightQuery, placement)),
          FieldInt(d, queries, i, offsetof(LightQuery, primitive))};
}

/// Collects lanes into results. A field that a kernel does not set stays 0.
template <class D>
struct ResultStore {
  D d;
  LightResult* results;
  size_t count;

  void Put(Real<D> value, float LightResult::*field) const {
    Each(value, [&](LightResult& r, float v) HWY_ATTR { r.*field = v; });
  }
  void Put(const Vec3<D>& value, float (LightResult::*field)[3]) const {
    Each(value.x, [&](LightResult& r, float v) HWY_ATTR { (r.*field)[0] = v; });
    Each(value.y, [&](LightResult& r, float v) HWY_ATTR { (r.*field)[1] = v; });
    Each(value.z, [&](LightResult& r, float v) HWY_ATTR { (r.*field)[2] = v; });
  }
  void PutB(Real<D> b1, Real<D> b2) const {
    Each(b1, [&](LightResult& r, float v) HWY_ATTR { r.b[0] = v; });
    Each(b2, [&](LightResult& r, float v) HWY_ATTR { r.b[1] = v; });
  }
  void PutLight(Int<D> light) const {
    HWY_ALIGN int32_t lanes[hn::MaxLanes(D())];
    hn::Store(light, IntTag<D>(), lanes);
    for (size_t i = 0; i < count; ++i) results[i].light = lanes[i];
  }
  void PutDelta(Mask<D> delta) const {
    Each(hn::IfThenElseZero(delta, Splat(d, 1)),
         [&](LightResult& r, float v) HWY_ATTR { r.delta = v != 0; });
  }

 private:
  template <class F>
  void Each(Real<D> value, const F& set) const {
    HWY_ALIGN float lanes[hn::MaxLanes(D())];
    hn::Store(value, d, lanes);
    for (size_t i = 0; i < count; ++i) set(results[i], lanes[i]);
  }
};

template <class D>
void LookUp(D d, const LightView& view, const LaneQuery<D>& q, const ResultStore<D>& out) {
  const EnvironmentValue<D> both = LookUpEnvironment(d, view.environment, q.dir);
  const Vec3<D> radiance = EnvironmentRadiance(d, view.environment, q.dir);
  const Real<D> pdf = EnvironmentPdf(d, view.environment, q.dir);
  out.Put(both.radiance, &LightResult::radiance);
  out.Put(both.pdf, &LightResult::pdf);
  out.Put(radiance, &LightResult::wi);
  out.Put(pdf, &LightResult::distance);
}

template <class D>
void SampleMap(D d, const LightView& view, const LaneQuery<D>& q, const ResultStore<D>& out) {
  const EnvironmentSample<D> s = SampleEnvironment(d, view.environment, q.u);
  out.Put(s.dir, &LightResult::wi);
  out.Put(s.radiance, &LightResult::radiance);
  out.Put(s.pdf, &LightResult::pdf);
}

template <class D>
void Pick(D d, const LightView& view, Mask<D> active, const LaneQuery<D>& q,
          const ResultStore<D>& out) {
  const LightPick<D> pick = PickLight(d, view, active, q.position, q.normal, q.u_pick);
  out.PutLight(pick.light);
  out.Put(pick.probability, &LightResult::pdf);
  out.Put(pick.u_remapped, &LightResult::u);
}

template <class D>
void SampleOneTriangle(D d, const LaneQuery<D>& q, const ResultStore<D>& out) {
  const TriangleLightSample<D> s = SampleTriangleLight(d, q.p0, q.p1, q.p2, q.position, q.u);
  out.PutB(s.b1, s.b2);
  out.Put(s.wi, &LightResult::wi);
  out.Put(s.distance, &LightResult::distance);
  out.Put(s.pdf, &LightResult::pdf);
}

template <class D>
void SampleAny(D d, const LightView& view, Mask<D> active, const LaneQuery<D>& q,
               const ResultStore<D>& out) {
  const LightSample<D> s = SampleLight(d, view, active, q.position, q.normal, q.u_pick, q.u);
  out.Put(s.wi, &LightResult::wi);
  out.Put(s.distance, &LightResult::distance);
  out.Put(s.radiance_or_irradiance, &LightResult::radiance);
  out.Put(s.pdf, &LightResult::pdf);
  out.PutDelta(s.delta);
  out.PutLight(s.light);
  out.PutB(s.b1, s.b2);
}

template <class D>
void Vertices(D d, const LightView& view, const LaneQuery<D>& q, const ResultStore<D>& out) {
  const Triangle<D> t = TriangleVertices(d, view.geometry, q.placement, q.primitive);
  out.Put(t.p0, &LightResult::wi);
  out.Put(t.p1, &LightResult::radiance);
  out.Put(t.p2, &LightResult::third);
  out.PutDelta(t.mirrored);
}

template <class D>
void RunOne(D d, LightKernel kernel, const LightView& view, Mask<D> active, const LaneQuery<D>& q,
            const ResultStore<D>& out) {
  switch (kernel) {
    case LightKernel::look_up_environment:
      return LookUp(d, view, q, out);
    case LightKernel::sample_environment:
      return SampleMap(d, view, q, out);
    case LightKernel::pick_light:
      return Pick(d, view, active, q, out);
    case LightKernel::pick_probability:
      return out.Put(PickProbability(d, view, active, q.position, q.normal, q.light),
                     &LightResult::pdf);
    case LightKernel::sample_triangle:
      return SampleOneTriangle(d, q, out);
    case LightKernel::triangle_pdf:
      return out.Put(TriangleLightPdf(d, q.p0, q.p1, q.p2, q.position, q.dir, q.distance),
                     &LightResult::pdf);
    case LightKernel::sample_light:
      return SampleAny(d, view, active, q, out);
    case LightKernel::triangle_hit_pdf:
      return out.Put(LightPdfForTriangleHit(d, view, active, q.position, q.normal, q.light, q.p0,
                                            q.p1, q.p2, q.dir, q.distance),
                     &LightResult::pdf);
    case LightKernel::environment_hit_pdf:
      return out.Put(LightPdfForEnvironment(d, view, q.dir), &LightResult::pdf);
    case LightKernel::triangle_vertices:
      return Vertices(d, view, q, out);
  }
}

/// What lanes that are not active may hold: numbers that lead nowhere. Placements must be valid
/// even so.
LightQuery Junk() {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  LightQuery q;
  for (float* v : {q.position, q.normal, q.dir, q.p, q.p + 3, q.p + 6}) v[0] = v[1] = v[2] = kNan;
  q.distance = q.u_pick = q.u[0] = q.u[1] = kNan;
  q.light = std::numeric_limits<int32_t>::max();
  return q;
}

template <class D>
std::vector<LightResult> RunAll(D d, LightKernel kernel, const LightView& view,
                                std::vector<LightQuery> queries) {
  const IntTag<D> di;
  std::vector<LightResult> results(queries.size());
  const size_t lanes = hn::Lanes(d);
  queries.resize((queries.size() + lanes - 1) / lanes * lanes, Junk());
  for (size_t begin = 0; begin < results.size(); begin += lanes) {
    const size_t count = std::min(lanes, results.size() - begin);
    RunOne(d, kernel, view, hn::FirstN(d, count),
           LoadQueries(d, queries.data() + begin, hn::Iota(di, 0)),
           ResultStore<D>{d, results.data() + begin, count});
  }
  return results;
}

std::vector<LightResult> RunWide(LightKernel kernel, const LightView& view,
                                 const std::vector<LightQuery>& queries) {
  return RunAll(hn::ScalableTag<float>(), kernel, view, queries);
}
std::vector<LightResult> RunOneLane(LightKernel kernel, const LightView& view,
                                    const std::vector<LightQuery>& queries) {
  return RunAll(hn::CappedTag<float, 1>(), kernel, view, queries);
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carpool::stages {

HWY_EXPORT(RunWide);
HWY_EXPORT(RunOneLane);

namespace {

LightRunner RunnerFor(int64_t target, bool wide) {
  const std::string name = hwy::TargetName(target);
  return {name + (wide ? " wide" : " x1"), name,
          [target, wide](LightKernel kernel, const LightView& view,
                         const std::vector<LightQuery>& queries) {
            hwy::SetSupportedTargetsForTest(target);
            auto results = wide ? HWY_DYNAMIC_DISPATCH(RunWide)(kernel, view, queries)
                                : HWY_DYNAMIC_DISPATCH(RunOneLane)(kernel, view, queries);
            hwy::SetSupportedTargetsForTest(0);
            return results;
          }};
}

}  // namespace

std::vector<LightRunner> AllLightRunners() {
  std::vector<LightRunner> runners;
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
    runners.push_back(RunnerFor(target, true));
    runners.push_back(RunnerFor(target, false));
  }
  return runners;
}

LightRunner BestLightRunner() {
  return AllLightRunners().front();
}

}  // namespace carpool::stages
#endif
