// Ray queries through Embree: single rays for what bounced, coherent packets for camera rays.
#include "stages/tracing/trace.h"

#include <limits>
#include <span>

#include "stages/tracing/layers.h"

namespace carpool::stages {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Shrinks ray.tfar to the nearest hit of `level`; true if there is one.
bool Nearest(const TraceLevel& level, RTCRayHit& ray, PathState& path) {
  if (level.scene == nullptr) return false;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  EmbreeIntersect1(level.scene, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
  path.placement = PlacementOf(level, ray.hit.instID[0], ray.hit.geomID);
  path.primitive = ray.hit.primID;
  path.u = ray.hit.u;
  path.v = ray.hit.v;
  path.distance = ray.ray.tfar;
  return true;
}

void NearestOfPacket(const TraceLevel& level, const int* valid, RTCRayHit8& rays,
                     PathState* const paths[8]) {
  if (level.scene == nullptr) return;
  for (int i = 0; i < 8; ++i) {
    rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  EmbreeIntersect8(valid, level.scene, &rays, Coherence::coherent);
  for (int i = 0; i < 8; ++i) {
    if (valid[i] == 0 || rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
    PathState& path = *paths[i];
    path.placement = PlacementOf(level, rays.hit.instID[0][i], rays.hit.geomID[i]);
    path.primitive = rays.hit.primID[i];
    path.u = rays.hit.u[i];
    path.v = rays.hit.v[i];
    path.distance = rays.ray.tfar[i];
  }
}

void MarkFirstLayer(PathState& path) {
  path.first_layer = {path.placement, path.primitive, path.distance};
}

// Product of what the transparent layers along the shadow ray let through.
float Transmittance(const TraceView& view, const OpacityQuery& query, const PathState& path) {
  const std::span<const LayerHit> layers = ShadowLayers(view, path);
  if (layers.size() > kMaxAlphaLayers) return 0;
  float through = 1;
  for (const LayerHit& hit : layers) {
    through *= 1 - query.opacity(query.context, hit.placement, hit.primitive, hit.u, hit.v);
    if (through <= 0) return 0;
  }
  return through;
}

}  // namespace

void IntersectPath(const TraceView& view, PathState& path) {
  const bool fresh = (path.flags & kPathLayerMask) == 0;
  if (!fresh) {
    if (NextLayerHere(view, path)) return;
    path.tnear = path.first_layer.distance + LayerReach(path);
  }
  const TriangleName left = {path.placement, path.primitive};
  RTCRayHit ray;
  SetRay(ray.ray, path.origin, path.direction, path.tnear, kInfinity);
  path.placement = kNone;
  Nearest(view.opaque, ray, path);
  Nearest(view.transparent, ray, path);
  // A ray never meets the triangle that it leaves, whatever rounding says: a needle's plane may be
  // off by far more than any bound on the origin.
  if (fresh && path.placement != kNone && left == TriangleName{path.placement, path.primitive})
    NearestBut(view, left, path);
  MarkFirstLayer(path);
}

void IntersectPacket(const TraceView& view, PathState* const paths[8]) {
  alignas(32) int valid[8];
  RTCRayHit8 rays;
  for (int i = 0; i < 8; ++i) {
    valid[i] = paths[i] != nullptr ? -1 : 0;
    const PathState* const p = paths[i];
    rays.ray.org_x[i] = p != nullptr ? p->origin[0] : 0;
    rays.ray.org_y[i] = p != nullptr ? p->origin[1] : 0;
    rays.ray.org_z[i] = p != nullptr ? p->origin[2] : 0;
    rays.ray.dir_x[i] = p != nullptr ? p->direction[0] : 0;
    rays.ray.dir_y[i] = p != nullptr ? p->direction[1] : 0;
    rays.ray.dir_z[i] = p != nullptr ? p->direction[2] : 1;
    rays.ray.tnear[i] = p != nullptr ? p->tnear : 0;
    rays.ray.tfar[i] = kInfinity;
    rays.ray.time[i] = 0;
    rays.ray.mask[i] = ~0u;
    rays.ray.id[i] = 0;
    rays.ray.flags[i] = 0;
    if (paths[i] != nullptr) paths[i]->placement = -1;
  }
  NearestOfPacket(view.opaque, valid, rays, paths);
  NearestOfPacket(view.transparent, valid, rays, paths);
  for (int i = 0; i < 8; ++i) {
    if (paths[i] != nullptr) MarkFirstLayer(*paths[i]);
  }
}

void TraceShadow(const TraceView& view, const OpacityQuery& opacity, PathState& path) {
  float through = 1;
  if (view.opaque.scene != nullptr) {
    RTCRay ray;
    SetRay(ray, path.origin, path.shadow_direction, 0, path.shadow_distance);
    // As in IntersectPath, the triangle that the ray leaves does not count.
    EmbreeOccluded1(view.opaque.scene, &ray, [&](const RTCHit& hit, float) {
      return hit.primID != path.primitive ||
             PlacementOf(view.opaque, hit.instID[0], hit.geomID) != path.placement;
    });
    if (ray.tfar < 0) through = 0;
  }
  if (through > 0 && view.transparent.scene != nullptr) {
    through = Transmittance(view, opacity, path);
  }
  for (int c = 0; c < 3; ++c) path.radiance[c] += through * path.shadow_radiance[c];
  path.shadow_distance = 0;
}

}  // namespace carpool::stages
