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

/// What travels with rays whose hits are looked at: Embree hands its context back to the filter.
/// `accept(id, RTCHit, t)` says whether a hit of the ray with this id counts.
template <class Accept>
struct FilterContext {
  EmbreeContext embree;
  Accept accept;

  static void Filter(const RTCFilterFunctionNArguments* arguments) {
    const auto* const self = reinterpret_cast<const FilterContext*>(arguments->context);
    const unsigned n = arguments->N;
    for (unsigned i = 0; i < n; ++i) {
      if (arguments->valid[i] == 0) continue;
      const bool accepted =
          self->accept(RTCRayN_id(arguments->ray, n, i), rtcGetHitFromHitN(arguments->hit, n, i),
                       RTCRayN_tfar(arguments->ray, n, i));
      if (!accepted) arguments->valid[i] = 0;
    }
  }
};

/// Ray packets of each size that Embree has, and its queries by size.
template <int kSize>
struct EmbreePacket;
template <>
struct EmbreePacket<4> {
  using Ray = RTCRay4;
  using RayHit = RTCRayHit4;
  static constexpr auto kIntersect = &rtcIntersect4;
  static constexpr auto kOccluded = &rtcOccluded4;
};
template <>
struct EmbreePacket<8> {
  using Ray = RTCRay8;
  using RayHit = RTCRayHit8;
  static constexpr auto kIntersect = &rtcIntersect8;
  static constexpr auto kOccluded = &rtcOccluded8;
};
template <>
struct EmbreePacket<16> {
  using Ray = RTCRay16;
  using RayHit = RTCRayHit16;
  static constexpr auto kIntersect = &rtcIntersect16;
  static constexpr auto kOccluded = &rtcOccluded16;
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
template <int kSize>
void EmbreeIntersect(const int* valid, RTCScene scene, typename EmbreePacket<kSize>::RayHit* rays,
                     Coherence c) {
  RTCIntersectArguments arguments = IntersectArguments(c);
  EmbreePacket<kSize>::kIntersect(valid, scene, rays, &arguments);
}
inline void EmbreeOccluded1(RTCScene scene, RTCRay* ray) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  rtcOccluded1(scene, ray, &arguments);
}
template <int kSize>
void EmbreeOccluded(const int* valid, RTCScene scene, typename EmbreePacket<kSize>::Ray* rays) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  EmbreePacket<kSize>::kOccluded(valid, scene, rays, &arguments);
}
template <class Accept>
RTCOccludedArguments FilteredArguments(FilterContext<Accept>& context) {
  rtcInitRayQueryContext(&context.embree);
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = static_cast<RTCRayQueryFlags>(RTC_RAY_QUERY_FLAG_INCOHERENT |
                                                  RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER);
  arguments.context = &context.embree;
  arguments.filter = &FilterContext<Accept>::Filter;
  return arguments;
}
/// Is there a hit that accept(id, RTCHit, t) takes? Then ray->tfar is negative. Hits come in no
/// order, some maybe twice; the scene needs kFilterPerRay.
template <class Accept>
void EmbreeOccluded1(RTCScene scene, RTCRay* ray, Accept accept) {
  FilterContext<Accept> context{{}, std::move(accept)};
  RTCOccludedArguments arguments = FilteredArguments(context);
  rtcOccluded1(scene, ray, &arguments);
}
template <int kSize, class Accept>
void EmbreeOccluded(const int* valid, RTCScene scene, typename EmbreePacket<kSize>::Ray* rays,
                    Accept accept) {
  FilterContext<Accept> context{{}, std::move(accept)};
  RTCOccludedArguments arguments = FilteredArguments(context);
  EmbreePacket<kSize>::kOccluded(valid, scene, rays, &arguments);
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
template <int kSize>
void EmbreeIntersect(const int* valid, RTCScene scene, typename EmbreePacket<kSize>::RayHit* rays,
                     Coherence c) {
  RTCIntersectContext context = IntersectContext(c);
  EmbreePacket<kSize>::kIntersect(valid, scene, &context, rays);
}
inline void EmbreeOccluded1(RTCScene scene, RTCRay* ray) {
  RTCIntersectContext context = IntersectContext(Coherence::incoherent);
  rtcOccluded1(scene, &context, ray);
}
template <int kSize>
void EmbreeOccluded(const int* valid, RTCScene scene, typename EmbreePacket<kSize>::Ray* rays) {
  RTCIntersectContext context = IntersectContext(Coherence::incoherent);
  EmbreePacket<kSize>::kOccluded(valid, scene, &context, rays);
}
template <class Accept>
void EmbreeOccluded1(RTCScene scene, RTCRay* ray, Accept accept) {
  FilterContext<Accept> context{IntersectContext(Coherence::incoherent), std::move(accept)};
  context.embree.filter = &FilterContext<Accept>::Filter;
  rtcOccluded1(scene, &context.embree, ray);
}
template <int kSize, class Accept>
void EmbreeOccluded(const int* valid, RTCScene scene, typename EmbreePacket<kSize>::Ray* rays,
                    Accept accept) {
  FilterContext<Accept> context{IntersectContext(Coherence::incoherent), std::move(accept)};
  context.embree.filter = &FilterContext<Accept>::Filter;
  EmbreePacket<kSize>::kOccluded(valid, scene, &context.embree, rays);
}

#endif

/// The widest packets that the device traces as such.
inline int NativePacketSize(RTCDevice device) {
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0) return 16;
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0) return 8;
  return 4;
}

}  // namespace carpool::stages
