// Ray queries through Embree: single rays, packets of what bounced, coherent packets for camera
// rays.
#include "stages/tracing/trace.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <numeric>
#include <span>

#include "hwy/highway.h"
#include "stages/tracing/layers.h"
#include "stages/tracing/packet_size.h"

namespace carpool::stages {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

TriangleName LastTriangle(const PathState& path) {
  return {path.placement, path.primitive};
}

void MarkFirstLayer(PathState& path) {
  path.first_layer = {path.placement, path.primitive, path.distance};
}

bool IsFresh(const PathState& path) {
  return (path.flags & kPathLayerMask) == 0;
}

/// Ready for its next query; false if the next hit was at the same place as the last and is known.
bool NeedsTracing(const TraceView& view, PathState& path) {
  if (IsFresh(path)) return true;
  if (NextLayerHere(view, path)) return false;
  path.tnear = path.first_layer.distance + LayerReach(path);
  return true;
}

/// A ray never meets the triangle that it leaves, whatever rounding says: a needle's plane may be
/// off by far more than any bound on the origin.
void FinishTracing(const TraceView& view, const TriangleName& left, PathState& path) {
  if (IsFresh(path) && path.placement != kNone && left == LastTriangle(path))
    NearestBut(view, left, path);
  MarkFirstLayer(path);
}

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

/// The paths of one packet; idle lanes have the first one's ray.
template <int kSize>
struct Packet {
  alignas(64) int valid[kSize] = {};
  PathState* paths[kSize];
  int count = 0;

  void Add(PathState& path) {
    valid[count] = -1;
    paths[count++] = &path;
  }
  void Clear() {
    std::fill_n(valid, kSize, 0);
    count = 0;
  }
  const PathState& Lane(int i) const { return *paths[i < count ? i : 0]; }
};

/// Four neighbouring floats of each path, the first at `offset`, to four arrays.
template <int kSize>
void Transpose(const Packet<kSize>& packet, size_t offset, float* x, float* y, float* z, float* w) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::FixedTag<float, 4> d;
  for (int i = 0; i < kSize; i += 4) {
    const auto load = [&](int k) {
      const auto* const path = reinterpret_cast<const std::byte*>(&packet.Lane(i + k));
      return hn::Load(d, reinterpret_cast<const float*>(path + offset));
    };
    const auto a = load(0), b = load(1), c = load(2), e = load(3);
    const auto ac_low = hn::InterleaveLower(d, a, c), be_low = hn::InterleaveLower(d, b, e);
    const auto ac_high = hn::InterleaveUpper(d, a, c), be_high = hn::InterleaveUpper(d, b, e);
    hn::Store(hn::InterleaveLower(d, ac_low, be_low), d, x + i);
    hn::Store(hn::InterleaveUpper(d, ac_low, be_low), d, y + i);
    hn::Store(hn::InterleaveLower(d, ac_high, be_high), d, z + i);
    hn::Store(hn::InterleaveUpper(d, ac_high, be_high), d, w + i);
  }
}

/// The packet's rays: from the paths' origins, along the directions at `direction`. The float
/// behind a direction goes to `behind`.
template <int kSize, class Rays>
void SetRays(Rays& rays, const Packet<kSize>& packet, size_t direction, float* behind) {
  Transpose(packet, offsetof(PathState, origin), rays.org_x, rays.org_y, rays.org_z, rays.tnear);
  Transpose(packet, direction, rays.dir_x, rays.dir_y, rays.dir_z, behind);
  std::fill_n(rays.time, kSize, 0.0f);
  std::fill_n(rays.mask, kSize, ~0u);
  std::iota(rays.id, rays.id + kSize, 0u);
  std::fill_n(rays.flags, kSize, 0u);
}
static_assert(offsetof(PathState, tnear) == offsetof(PathState, origin) + 12 &&
              offsetof(PathState, shadow_distance) == offsetof(PathState, shadow_direction) + 12);

template <int kSize, class RayHits>
void NearestOfPacket(const TraceLevel& level, const Packet<kSize>& packet, RayHits& rays,
                     Coherence coherence) {
  if (level.scene == nullptr) return;
  for (int i = 0; i < kSize; ++i) {
    rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  EmbreeIntersect<kSize>(packet.valid, level.scene, &rays, coherence);
  for (int i = 0; i < packet.count; ++i) {
    if (rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
    PathState& path = *packet.paths[i];
    path.placement = PlacementOf(level, rays.hit.instID[0][i], rays.hit.geomID[i]);
    path.primitive = rays.hit.primID[i];
    path.u = rays.hit.u[i];
    path.v = rays.hit.v[i];
    path.distance = rays.ray.tfar[i];
  }
}

/// Finds the nearest hits of the packet's rays.
template <int kSize>
void IntersectPacket(const TraceView& view, const Packet<kSize>& packet, Coherence coherence) {
  typename EmbreePacket<kSize>::RayHit rays;
  SetRays(rays.ray, packet, offsetof(PathState, direction), rays.ray.tfar);
  std::fill_n(rays.ray.tfar, kSize, kInfinity);  // over what is behind the direction
  for (int i = 0; i < packet.count; ++i) packet.paths[i]->placement = kNone;
  NearestOfPacket(view.opaque, packet, rays, coherence);
  NearestOfPacket(view.transparent, packet, rays, coherence);
}

template <int kSize>
void IntersectSlots(const TraceView& view, PathState* paths, std::span<const uint32_t> slots) {
  Packet<kSize> packet;
  TriangleName left[kSize];
  for (size_t i = 0; i < slots.size(); ++i) {
    if (i + kSize < slots.size()) PrefetchPath(&paths[slots[i + kSize]]);
    PathState& path = paths[slots[i]];
    if (NeedsTracing(view, path)) {
      left[packet.count] = LastTriangle(path);
      packet.Add(path);
    }
    if (packet.count < kSize && i + 1 < slots.size()) continue;
    if (packet.count > 0) IntersectPacket(view, packet, Coherence::incoherent);
    for (int k = 0; k < packet.count; ++k) FinishTracing(view, left[k], *packet.paths[k]);
    packet.Clear();
  }
}

// Product of what the transparent layers along the shadow ray let through.
float Transmittance(const TraceView& view, const OpacityQuery& query, const PathState& path) {
  if (view.transparent.scene == nullptr) return 1;
  const std::span<const LayerHit> layers = ShadowLayers(view, path);
  if (layers.size() > kMaxAlphaLayers) return 0;
  float through = 1;
  for (const LayerHit& hit : layers) {
    through *= 1 - query.opacity(query.context, hit.placement, hit.primitive, hit.u, hit.v);
    if (through <= 0) return 0;
  }
  return through;
}

/// The shadow ray leaves a triangle that does not count, as in FinishTracing.
bool IsOther(const TraceView& view, const PathState& path, const RTCHit& hit) {
  return hit.primID != path.primitive ||
         PlacementOf(view.opaque, hit.instID[0], hit.geomID) != path.placement;
}

void AddShadowed(const TraceView& view, const OpacityQuery& opacity, bool occluded,
                 PathState& path) {
  const float through = occluded ? 0 : Transmittance(view, opacity, path);
  for (int c = 0; c < 3; ++c) path.radiance[c] += through * path.shadow_radiance[c];
  path.shadow_distance = 0;
}

template <int kSize>
void TracePacketShadows(const TraceView& view, const OpacityQuery& opacity,
                        const Packet<kSize>& packet) {
  typename EmbreePacket<kSize>::Ray rays;
  SetRays(rays, packet, offsetof(PathState, shadow_direction), rays.tfar);
  std::fill_n(rays.tnear, kSize, 0.0f);
  if (view.opaque.scene != nullptr) {
    EmbreeOccluded<kSize>(packet.valid, view.opaque.scene, &rays,
                          [&](unsigned lane, const RTCHit& hit, float) {
                            return IsOther(view, *packet.paths[lane], hit);
                          });
  }
  for (int i = 0; i < packet.count; ++i)
    AddShadowed(view, opacity, rays.tfar[i] < 0, *packet.paths[i]);
}

template <int kSize>
void TraceSlotShadows(const TraceView& view, const OpacityQuery& opacity, PathState* paths,
                      std::span<const uint32_t> slots) {
  Packet<kSize> packet;
  for (size_t i = 0; i < slots.size(); ++i) {
    if (i + kSize < slots.size()) PrefetchPath(&paths[slots[i + kSize]]);
    packet.Add(paths[slots[i]]);
    if (packet.count < kSize && i + 1 < slots.size()) continue;
    TracePacketShadows(view, opacity, packet);
    packet.Clear();
  }
}

}  // namespace

void IntersectPath(const TraceView& view, PathState& path) {
  if (!NeedsTracing(view, path)) return;
  const TriangleName left = LastTriangle(path);
  RTCRayHit ray;
  SetRay(ray.ray, path.origin, path.direction, path.tnear, kInfinity);
  path.placement = kNone;
  Nearest(view.opaque, ray, path);
  Nearest(view.transparent, ray, path);
  FinishTracing(view, left, path);
}

void IntersectPaths(const TraceView& view, PathState* paths, std::span<const uint32_t> slots) {
  WithPacketSize(view.packet_size, [&](auto size) { IntersectSlots<size()>(view, paths, slots); });
}

void IntersectPacket(const TraceView& view, PathState* const paths[8]) {
  Packet<8> packet;
  for (int i = 0; i < 8; ++i) {
    if (paths[i] != nullptr) packet.Add(*paths[i]);
  }
  if (packet.count == 0) return;
  IntersectPacket(view, packet, Coherence::coherent);
  for (int i = 0; i < packet.count; ++i) MarkFirstLayer(*packet.paths[i]);
}

void TraceShadow(const TraceView& view, const OpacityQuery& opacity, PathState& path) {
  bool occluded = false;
  if (view.opaque.scene != nullptr) {
    RTCRay ray;
    SetRay(ray, path.origin, path.shadow_direction, 0, path.shadow_distance);
    EmbreeOccluded1(view.opaque.scene, &ray,
                    [&](unsigned, const RTCHit& hit, float) { return IsOther(view, path, hit); });
    occluded = ray.tfar < 0;
  }
  AddShadowed(view, opacity, occluded, path);
}

void TraceShadows(const TraceView& view, const OpacityQuery& opacity, PathState* paths,
                  std::span<const uint32_t> slots) {
  WithPacketSize(view.packet_size,
                 [&](auto size) { TraceSlotShadows<size()>(view, opacity, paths, slots); });
}

}  // namespace carpool::stages
