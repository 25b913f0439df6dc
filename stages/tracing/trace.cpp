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

/// The paths of one packet. Once it is closed, idle lanes have the first one's.
template <int kSize>
struct Packet {
  alignas(64) int valid[kSize];
  PathState* paths[kSize];
  int count = 0;

  void Add(PathState& path) { paths[count++] = &path; }
  void Close() {
    for (int i = 0; i < kSize; ++i) valid[i] = i < count ? -1 : 0;
    std::fill(paths + count, paths + kSize, paths[0]);
  }
};

namespace hn = hwy::HWY_NAMESPACE;
using Four = hn::FixedTag<float, 4>;
using FourWords = hn::Vec<Four>;

/// Rows to columns, or columns to rows.
struct Square {
  FourWords a, b, c, e;
};
Square Transposed(const Square& s) {
  const Four d;
  const auto ac_low = hn::InterleaveLower(d, s.a, s.c), be_low = hn::InterleaveLower(d, s.b, s.e);
  const auto ac_high = hn::InterleaveUpper(d, s.a, s.c), be_high = hn::InterleaveUpper(d, s.b, s.e);
  return {hn::InterleaveLower(d, ac_low, be_low), hn::InterleaveUpper(d, ac_low, be_low),
          hn::InterleaveLower(d, ac_high, be_high), hn::InterleaveUpper(d, ac_high, be_high)};
}

FourWords LoadWords(const PathState& path, size_t offset) {
  const auto* const words = reinterpret_cast<const std::byte*>(&path) + offset;
  return hn::Load(Four(), reinterpret_cast<const float*>(words));
}
void StoreWords(FourWords words, PathState& path, size_t offset) {
  hn::Store(words, Four(), reinterpret_cast<float*>(reinterpret_cast<std::byte*>(&path) + offset));
}

/// Four neighbouring floats of each path, the first at `offset`, to four arrays.
template <int kSize>
void Transpose(const Packet<kSize>& packet, size_t offset, float* x, float* y, float* z, float* w) {
  const Four d;
  for (int i = 0; i < kSize; i += 4) {
    const auto load = [&](int k) { return LoadWords(*packet.paths[i + k], offset); };
    const Square columns = Transposed({load(0), load(1), load(2), load(3)});
    hn::Store(columns.a, d, x + i);
    hn::Store(columns.b, d, y + i);
    hn::Store(columns.c, d, z + i);
    hn::Store(columns.e, d, w + i);
  }
}

/// What all packets of rays have in common; queries leave it alone.
template <int kSize, class Rays>
void SetCommon(Rays& rays) {
  std::fill_n(rays.time, kSize, 0.0f);
  std::fill_n(rays.mask, kSize, ~0u);
  std::iota(rays.id, rays.id + kSize, 0u);
  std::fill_n(rays.flags, kSize, 0u);
}

/// The packet's rays: from the paths' origins, along the directions at `direction`. The float
/// behind a direction goes to `behind`.
template <int kSize, class Rays>
void SetRays(Rays& rays, const Packet<kSize>& packet, size_t direction, float* behind) {
  Transpose(packet, offsetof(PathState, origin), rays.org_x, rays.org_y, rays.org_z, rays.tnear);
  Transpose(packet, direction, rays.dir_x, rays.dir_y, rays.dir_z, behind);
}
static_assert(offsetof(PathState, tnear) == offsetof(PathState, origin) + 12 &&
              offsetof(PathState, shadow_distance) == offsetof(PathState, shadow_direction) + 12);

/// What the rays of a packet hit; u, v and the distance are Embree's.
template <int kSize>
struct PacketHits {
  typename EmbreePacket<kSize>::RayHit rays;
  alignas(16) int32_t placement[kSize];

  PacketHits() { SetCommon<kSize>(rays.ray); }

  /// Finds the nearest hits of the rays, whose origins, directions and beginnings are set.
  void Find(const TraceView& view, const int* valid, Coherence coherence) {
    std::fill_n(rays.ray.tfar, kSize, kInfinity);
    std::fill_n(rays.hit.primID, kSize, 0u);  // of rays that miss: unread, but copied
    std::fill_n(rays.hit.u, kSize, 0.0f);
    std::fill_n(rays.hit.v, kSize, 0.0f);
    std::fill_n(placement, kSize, kNone);
    if (view.opaque.scene != nullptr) {
      Trace(view.opaque, valid, coherence);
      for (int i = 0; i < kSize; ++i)
        placement[i] = PlacementOf(view.opaque, rays.hit.instID[0][i], rays.hit.geomID[i]);
    }
    if (view.transparent.scene != nullptr) {
      Trace(view.transparent, valid, coherence);
      for (int i = 0; i < kSize; ++i) {
        if (rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
        placement[i] = PlacementOf(view.transparent, rays.hit.instID[0][i], rays.hit.geomID[i]);
      }
    }
  }

 private:
  void Trace(const TraceLevel& level, const int* valid, Coherence coherence) {
    std::fill_n(rays.hit.geomID, kSize, RTC_INVALID_GEOMETRY_ID);
    std::fill_n(rays.hit.instID[0], kSize, RTC_INVALID_GEOMETRY_ID);
    EmbreeIntersect<kSize>(valid, level.scene, &rays, coherence);
  }
};

/// Writes the hits to the paths, and marks them as the first at their place.
template <int kSize>
void StoreHits(const PacketHits<kSize>& hits, const Packet<kSize>& packet) {
  const Four d;
  const hn::RebindToSigned<Four> di;
  const auto& hit = hits.rays.hit;
  for (int i = 0; i < packet.count; i += 4) {
    const auto placement = hn::BitCast(d, hn::Load(di, hits.placement + i));
    const auto primitive =
        hn::BitCast(d, hn::Load(di, reinterpret_cast<const int32_t*>(hit.primID + i)));
    const auto distance = hn::Load(d, hits.rays.ray.tfar + i);
    const Square rows =
        Transposed({primitive, hn::Load(d, hit.u + i), hn::Load(d, hit.v + i), distance});
    const Square marks = Transposed({placement, primitive, distance, hn::Zero(d)});
    const auto store = [&](int k, FourWords row, FourWords mark) {
      if (i + k >= packet.count) return;
      PathState& path = *packet.paths[i + k];
      path.placement = hits.placement[i + k];
      StoreWords(row, path, offsetof(PathState, primitive));
      StoreWords(mark, path, offsetof(PathState, first_layer));
    };
    store(0, rows.a, marks.a);
    store(1, rows.b, marks.b);
    store(2, rows.c, marks.c);
    store(3, rows.e, marks.e);
  }
}
static_assert(offsetof(PathState, distance) == offsetof(PathState, primitive) + 12 &&
              offsetof(PathState, shadow_distance) == offsetof(PathState, first_layer) + 12);

template <int kSize>
void IntersectSlots(const TraceView& view, PathState* paths, std::span<const uint32_t> slots) {
  Packet<kSize> packet;
  PacketHits<kSize> hits;
  TriangleName left[kSize];
  for (size_t i = 0; i < slots.size(); ++i) {
    if (i + kSize < slots.size()) PrefetchPath(&paths[slots[i + kSize]]);
    PathState& path = paths[slots[i]];
    if (NeedsTracing(view, path)) {
      left[packet.count] = LastTriangle(path);
      packet.Add(path);
    }
    if (packet.count < kSize && i + 1 < slots.size()) continue;
    if (packet.count == 0) return;
    packet.Close();
    auto& rays = hits.rays.ray;  // what is behind a direction is overwritten
    SetRays(rays, packet, offsetof(PathState, direction), rays.tfar);
    hits.Find(view, packet.valid, Coherence::incoherent);
    StoreHits(hits, packet);
    unsigned same = 0;
    for (int k = 0; k < packet.count; ++k) {
      const bool again =
          (hits.placement[k] == left[k].placement) & (hits.rays.hit.primID[k] == left[k].primitive);
      same |= static_cast<unsigned>(again) << k;
    }
    for (; same != 0; same &= same - 1) {
      const int k = __builtin_ctz(same);
      FinishTracing(view, left[k], *packet.paths[k]);
    }
    packet.count = 0;
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
  const Four d;
  const float through = occluded ? 0 : Transmittance(view, opacity, path);
  // Behind the light's three floats are the bits of a normal, which are no number.
  const FourWords light =
      hn::IfThenElseZero(hn::FirstN(d, 3), LoadWords(path, offsetof(PathState, shadow_radiance)));
  const FourWords before = LoadWords(path, offsetof(PathState, radiance));
  StoreWords(hn::Add(before, hn::Mul(hn::Set(d, through), light)), path,
             offsetof(PathState, radiance));
  path.shadow_distance = 0;
}

template <int kSize>
void TracePacketShadows(const TraceView& view, const OpacityQuery& opacity,
                        const Packet<kSize>& packet, typename EmbreePacket<kSize>::Ray& rays) {
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
  typename EmbreePacket<kSize>::Ray rays;
  SetCommon<kSize>(rays);
  for (size_t i = 0; i < slots.size(); ++i) {
    if (i + kSize < slots.size()) PrefetchPath(&paths[slots[i + kSize]]);
    packet.Add(paths[slots[i]]);
    if (packet.count < kSize && i + 1 < slots.size()) continue;
    packet.Close();
    TracePacketShadows(view, opacity, packet, rays);
    packet.count = 0;
  }
}

}  // namespace

void IntersectPath(const TraceView& view, PathState& path) {
  if (!NeedsTracing(view, path)) return;
  const TriangleName left = LastTriangle(path);
  RTCRayHit ray;
  SetRay(ray.ray, path.origin, path.direction, path.tnear, kInfinity);
  path.placement = kNone;
  path.primitive = 0;
  path.u = path.v = 0;
  path.distance = kInfinity;
  Nearest(view.opaque, ray, path);
  Nearest(view.transparent, ray, path);
  FinishTracing(view, left, path);
}

void IntersectPaths(const TraceView& view, PathState* paths, std::span<const uint32_t> slots) {
  WithPacketSize(view.packet_size, [&](auto size) { IntersectSlots<size()>(view, paths, slots); });
}

void IntersectCameraRays(const TraceView& view, CameraRays& rays) {
  PacketHits<kCameraGroup> hits;
  RTCRay8& ray = hits.rays.ray;
  const RTCHit8& hit = hits.rays.hit;
  std::fill_n(ray.tnear, kCameraGroup, 0.0f);
  float* const origin[3] = {ray.org_x, ray.org_y, ray.org_z};
  float* const direction[3] = {ray.dir_x, ray.dir_y, ray.dir_z};
  for (uint32_t first = 0; first < rays.count; first += kCameraGroup) {
    for (int c = 0; c < 3; ++c) {
      std::copy_n(rays.origin[c] + first, kCameraGroup, origin[c]);
      std::copy_n(rays.direction[c] + first, kCameraGroup, direction[c]);
    }
    hits.Find(view, rays.inside + first, Coherence::coherent);
    std::copy_n(hits.placement, kCameraGroup, rays.placement + first);
    std::copy_n(hit.primID, kCameraGroup, rays.primitive + first);
    std::copy_n(hit.u, kCameraGroup, rays.u + first);
    std::copy_n(hit.v, kCameraGroup, rays.v + first);
    std::copy_n(ray.tfar, kCameraGroup, rays.distance + first);
  }
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
