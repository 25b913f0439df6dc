// The order of hits along a ray that passes through surfaces, each surface once.
//
// Hits closer together than rays can be intersected are one place. At a place, the hit that was
// found first goes first and the others follow by distance, transparent before opaque, placement
// and triangle. A transparent hit is left out if one before it is of the same placement (one mesh
// of one instance) and on the same triangle or a neighbour, which shares a vertex: a ray through an
// edge meets the mesh once, while two meshes in one plane count as two.
#pragma once

#include <cstdint>
#include <span>

#include "stages/tracing/trace.h"

namespace carpool::stages {

struct TriangleName {
  int32_t placement;
  uint32_t primitive;
  bool operator==(const TriangleName&) const = default;
};

struct LayerHit {
  float distance;
  int32_t placement;
  uint32_t primitive;
  float u, v;
  bool opaque;
};

void SetRay(RTCRay& ray, const float origin[3], const float direction[3], float tnear, float tfar);

/// The placement of a hit on geometry `geometry` of `instance` (or of none); kNone of no hit.
inline int32_t PlacementOf(const TraceLevel& level, unsigned instance, unsigned geometry) {
  if (instance == RTC_INVALID_GEOMETRY_ID) return level.top[static_cast<int32_t>(geometry)];
  return level.nested[level.top[instance] + static_cast<int32_t>(geometry)];
}

/// Half the length of a place around the path's first hit there: some ulps of the coordinates that
/// the intersection went through.
float LayerReach(const PathState& path);

/// Moves the path to the hit after its last one at the same place; false if there is none.
bool NextLayerHere(const TraceView& view, PathState& path);

/// Finds the nearest hit of the path's ray that is not on the triangle `left`. Slow: meets all
/// hits.
void NearestBut(const TraceView& view, const TriangleName& left, PathState& path);

/// What the path's shadow ray meets of the transparent level, in order; more than kMaxAlphaLayers
/// hits are not told apart. Valid until the next call on this thread.
std::span<const LayerHit> ShadowLayers(const TraceView& view, const PathState& path);

}  // namespace carpool::stages
