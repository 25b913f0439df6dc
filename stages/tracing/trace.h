// Ray queries against the scene: what a path's ray hits, and how much of a shadow ray gets through.
#pragma once

#include <cstdint>
#include <span>

#include "stages/tables/camera_rays.h"
#include "stages/tables/geometry_view.h"
#include "stages/tables/path.h"
#include "stages/tracing/embree.h"

namespace carpool::stages {

/// One Embree scene and the way from its hits to placements: a hit on a flat geometry g is
/// placement `top[g]`; a hit on geometry g of instance i is placement `nested[top[i] + g]`. Before
/// the first entry stands kNone, top[-1]: where a ray hit nothing, Embree's number is ~0.
struct TraceLevel {
  RTCScene scene = nullptr;  // null: empty
  const int32_t* top = nullptr;
  const int32_t* nested = nullptr;
};

/// Opaque triangles and those whose material may let rays through live apart, so that shadow rays
/// ask one yes-or-no question for nearly everything, and no texture is read inside a traversal.
struct TraceView {
  TraceLevel opaque;
  TraceLevel transparent;
  GeometryView geometry;  // tells which triangles are neighbours
  int packet_size = 4;    // of IntersectPaths and TraceShadows: 4, 8 or 16
};

/// What stands at (placement, primitive, u, v) lets `1 - opacity` of a shadow ray through. Called
/// only for hits in `TraceView::transparent`.
struct OpacityQuery {
  const void* context = nullptr;
  float (*opacity)(const void* context, int32_t placement, uint32_t primitive, float u,
                   float v) = nullptr;
};

/// Finds the next hit of the path's ray and writes placement, primitive, u, v and distance: the
/// nearest, or the one after the last if that let the ray through (layers.h says what comes after
/// what). The triangle that a ray leaves, the last hit of a path whose ray is new, is not hit.
/// Deterministic: the same ray gives the same hit in every executor.
void IntersectPath(const TraceView& view, PathState& path);

/// Does the same for the paths in these slots, as packets: bit for bit what each path alone would
/// get, because packets that are not COHERENT go through the same arithmetic as single rays.
void IntersectPaths(const TraceView& view, PathState* paths, std::span<const uint32_t> slots);

/// Finds the nearest hits of camera rays: each group of a fixed 4x2 pixels is one coherent packet.
/// Within a packet, mates can change each other's hits in the last bit; groups are therefore the
/// same in every executor.
void IntersectCameraRays(const TraceView& view, CameraRays& rays);

/// Traces the path's shadow ray and adds its contribution, times what transparent layers let
/// through.
void TraceShadow(const TraceView& view, const OpacityQuery& opacity, PathState& path);

/// Does the same for the paths in these slots, as packets, bit for bit.
void TraceShadows(const TraceView& view, const OpacityQuery& opacity, PathState* paths,
                  std::span<const uint32_t> slots);

}  // namespace carpool::stages
