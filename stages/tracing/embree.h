// Embree 3 and 4 behind one set of names; the only place that knows which one it is.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <utility>

namespace carpool::stages {

enum class Coherence { incoherent, coherent };

#if RTC_VERSION_MAJOR >= 4
using EmbreeContext = RTCRayQueryContext;
constexpr RTCSceneFlags kFilterPerRay = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;
#else
using EmbreeContext = RTCIntersectContext;
constexpr RTCSceneFlags kFilterPerRay = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
#endif

/// What travels with a single ray whose hits are looked at: Embree hands its context back to the
/// filter. `accept(RTCHit, t)` says whether a hit counts.
template <class Accept>
struct FilterContext {
  EmbreeContext embree;
  Accept accept;

  static void Filter(const RTCFilterFunctionNArguments* arguments) {
    const auto* const self = reinterpret_cast<const FilterContext*>(arguments->context);
    const bool accepted = self->accept(rtcGetHitFromHitN(arguments->hit, arguments->N, 0),
                                       RTCRayN_tfar(arguments->ray, arguments->N, 0));
    if (!accepted) arguments->valid[0] = 0;
  }
};

#if RTC_VERSION_MAJOR >= 4

inline RTCIntersectArguments IntersectArguments(Coherence coherence) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = coherence == Coherence::coherent ? RTC_RAY_QUERY_FLAG_COHERENT
                                                     : RTC_RAY_QUERY_FLAG_INCOHERENT;
  return arguments;
}
inline void EmbreeIntersect1(RTCScene scene, RTCRayHit* ray) {
  RTCIntersectArguments arguments = IntersectArguments(Coherence::incoherent);
  rtcIntersect1(scene, ray, &arguments);
}
inline void EmbreeIntersect8(const int* valid, RTCScene scene, RTCRayHit8* rays, Coherence c) {
  RTCIntersectArguments arguments = IntersectArguments(c);
  rtcIntersect8(valid, scene, rays, &arguments);
}
inline void EmbreeOccluded1(RTCScene scene, RTCRay* ray) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  rtcOccluded1(scene, ray, &arguments);
}
/// Is there a hit that accept(RTCHit, t) takes? Then ray->tfar is negative. Hits come in no order,
/// some maybe twice; the scene needs kFilterPerRay.
template <class Accept>
void EmbreeOccluded1(RTCScene scene, RTCRay* ray, Accept accept) {
  FilterContext<Accept> context{{}, std::move(accept)};
  rtcInitRayQueryContext(&context.embree);
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = static_cast<RTCRayQueryFlags>(RTC_RAY_QUERY_FLAG_INCOHERENT |
                                                  RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER);
  arguments.context = &context.embree;
  arguments.filter = &FilterContext<Accept>::Filter;
  rtcOccluded1(scene, ray, &arguments);
}

#else

inline RTCIntersectContext IntersectContext(Coherence coherence) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = coherence == Coherence::coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                                   : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return context;
}
inline void EmbreeIntersect1(RTCScene scene, RTCRayHit* ray) {
  RTCIntersectContext context = IntersectContext(Coherence::incoherent);
  rtcIntersect1(scene, &context, ray);
}
inline void EmbreeIntersect8(const int* valid, RTCScene scene, RTCRayHit8* rays, Coherence c) {
  RTCIntersectContext context = IntersectContext(c);
  rtcIntersect8(valid, scene, &context, rays);
}
inline void EmbreeOccluded1(RTCScene scene, RTCRay* ray) {
  RTCIntersectContext context = IntersectContext(Coherence::incoherent);
  rtcOccluded1(scene, &context, ray);
}
template <class Accept>
void EmbreeOccluded1(RTCScene scene, RTCRay* ray, Accept accept) {
  FilterContext<Accept> context{IntersectContext(Coherence::incoherent), std::move(accept)};
  context.embree.filter = &FilterContext<Accept>::Filter;
  rtcOccluded1(scene, &context.embree, ray);
}

#endif

}  // namespace carpool::stages
