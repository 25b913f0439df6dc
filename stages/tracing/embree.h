// Embree 3 and 4 behind one set of names; the only place that knows which one it is.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace carpool::stages {

enum class Coherence { incoherent, coherent };

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

#endif

}  // namespace carpool::stages
