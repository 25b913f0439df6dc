// Gathers the hits of an interval of a ray, sorts them and leaves out neighbours.
#include "stages/tracing/layers.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <tuple>
#include <vector>

namespace carpool::stages {
namespace {

constexpr TriangleName kNoTriangle = {kNone, 0};

TriangleName NameOf(const LayerHit& hit) {
  return {hit.placement, hit.primitive};
}

bool Before(const LayerHit& a, const LayerHit& b) {
  return std::tie(a.distance, a.opaque, a.placement, a.primitive) <
         std::tie(b.distance, b.opaque, b.placement, b.primitive);
}

/// By place, not by number: meshes with a normal or texture coordinate per face have several
/// vertices at one place.
bool ShareVertex(const GeometryView& g, const Placement& p, uint32_t a, uint32_t b) {
  const auto corner = [&](uint32_t triangle, uint32_t k) {
    const uint32_t vertex = g.indices[static_cast<uint32_t>(p.first_index) + 3 * triangle + k];
    return g.vertices[static_cast<size_t>(p.first_vertex) + vertex].position;
  };
  for (uint32_t i = 0; i < 9; ++i) {
    if (std::memcmp(corner(a, i / 3), corner(b, i % 3), 3 * sizeof(float)) == 0) return true;
  }
  return false;
}

/// Is hit `i` met by a neighbour earlier in the list, at most `reach` before it?
bool IsRepeated(const GeometryView& g, std::span<const LayerHit> hits, size_t i, float reach) {
  const LayerHit& hit = hits[i];
  if (hit.opaque) return false;
  for (size_t k = i; k-- > 0 && std::abs(hit.distance - hits[k].distance) <= reach;) {
    if (hits[k].placement != hit.placement) continue;
    if (hits[k].primitive == hit.primitive ||
        ShareVertex(g, g.placements[hit.placement], hits[k].primitive, hit.primitive)) {
      return true;
    }
  }
  return false;
}

/// All hits but those on the triangle `left`, which the ray starts from.
void Gather(const TraceLevel& level, bool opaque, RTCRay ray, const TriangleName& left,
            std::vector<LayerHit>& hits) {
  if (level.scene == nullptr) return;
  // Accepting none, the query meets all.
  EmbreeOccluded1(level.scene, &ray, [&](unsigned, const RTCHit& hit, float distance) {
    const int32_t placement = PlacementOf(level, hit.instID[0], hit.geomID);
    if (left != TriangleName{placement, hit.primID})
      hits.push_back({distance, placement, hit.primID, hit.u, hit.v, opaque});
    return false;
  });
}

void MoveTo(const LayerHit& hit, PathState& path) {
  path.placement = hit.placement;
  path.primitive = hit.primitive;
  path.u = hit.u;
  path.v = hit.v;
  path.distance = hit.distance;
}

/// Scratch of this thread.
std::vector<LayerHit>& Scratch() {
  thread_local std::vector<LayerHit> hits;
  hits.clear();
  return hits;
}

float Reach(const float origin[3], float distance) {
  const float most =
      std::max({std::abs(origin[0]), std::abs(origin[1]), std::abs(origin[2]), distance});
  return most * 0x1p-20f;
}

}  // namespace

void SetRay(RTCRay& ray, const float origin[3], const float direction[3], float tnear, float tfar) {
  ray.org_x = origin[0];
  ray.org_y = origin[1];
  ray.org_z = origin[2];
  ray.dir_x = direction[0];
  ray.dir_y = direction[1];
  ray.dir_z = direction[2];
  ray.tnear = tnear;
  ray.tfar = tfar;
  ray.time = 0;
  ray.mask = ~0u;
  ray.id = 0;
  ray.flags = 0;
}

float LayerReach(const PathState& path) {
  return Reach(path.origin, path.first_layer.distance);
}

bool NextLayerHere(const TraceView& view, PathState& path) {
  const LayerMark& first = path.first_layer;
  const float reach = LayerReach(path);
  RTCRay ray;
  SetRay(ray, path.origin, path.direction, std::max(path.tnear, first.distance - reach),
         first.distance + reach);
  std::vector<LayerHit>& hits = Scratch();
  hits.push_back({first.distance, first.placement, first.primitive, 0, 0, false});
  Gather(view.transparent, false, ray, kNoTriangle, hits);
  Gather(view.opaque, true, ray, kNoTriangle, hits);
  const TriangleName first_name = {first.placement, first.primitive};
  const auto is_first = [&](const LayerHit& hit) { return NameOf(hit) == first_name; };
  hits.erase(std::remove_if(hits.begin() + 1, hits.end(), is_first), hits.end());
  std::sort(hits.begin() + 1, hits.end(), Before);

  const TriangleName last_name = {path.placement, path.primitive};
  const auto last = std::find_if(hits.begin(), hits.end(),
                                 [&](const LayerHit& hit) { return NameOf(hit) == last_name; });
  if (last == hits.end()) return false;
  for (size_t i = static_cast<size_t>(last - hits.begin()) + 1; i < hits.size(); ++i) {
    if (IsRepeated(view.geometry, hits, i, 2 * reach)) continue;
    MoveTo(hits[i], path);
    return true;
  }
  return false;
}

void NearestBut(const TraceView& view, const TriangleName& left, PathState& path) {
  RTCRay ray;
  SetRay(ray, path.origin, path.direction, path.tnear, std::numeric_limits<float>::infinity());
  std::vector<LayerHit>& hits = Scratch();
  Gather(view.transparent, false, ray, left, hits);
  Gather(view.opaque, true, ray, left, hits);
  path.placement = kNone;
  const auto nearest = std::min_element(hits.begin(), hits.end(), Before);
  if (nearest != hits.end()) MoveTo(*nearest, path);
}

std::span<const LayerHit> ShadowLayers(const TraceView& view, const PathState& path) {
  RTCRay ray;
  SetRay(ray, path.origin, path.shadow_direction, 0, path.shadow_distance);
  std::vector<LayerHit>& hits = Scratch();
  Gather(view.transparent, false, ray, {path.placement, path.primitive}, hits);
  if (hits.size() > kMaxAlphaLayers) return hits;
  std::sort(hits.begin(), hits.end(), Before);
  thread_local std::vector<LayerHit> once;
  once.clear();
  for (size_t i = 0; i < hits.size(); ++i) {
    if (!IsRepeated(view.geometry, hits, i, Reach(path.origin, hits[i].distance)))
      once.push_back(hits[i]);
  }
  return once;
}

}  // namespace carpool::stages
