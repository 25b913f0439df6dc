// The state of one path: two cache lines that travel by slot number through the stages' queues.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace carpool::stages {

/// The first of the hits at one place along a ray, as far as arithmetic can tell places apart.
struct LayerMark {
  int32_t placement;
  uint32_t primitive;
  float distance;
};

/// One path is in exactly one queue at a time, so its state has one owner at a time. 32 words.
struct alignas(128) PathState {
  // The ray to trace next; it starts at the previous vertex (moved off the surface by its error
  // bound).
  float origin[3];
  float tnear;         // 0, or past the transparent hits that this same ray has behind it
  float direction[3];  // unit length
  float pdf;           // solid-angle density that chose `direction`; 0: camera ray, no MIS partner
  float throughput[3];
  float cone_width;   // ray cone at the origin (metres) and its growth per metre
  float radiance[3];  // gathered so far
  float cone_spread;

  uint32_t pixel;  // y * width + x
  uint32_t sample;
  uint32_t flags;     // PathFlags and counters
  int32_t placement;  // what the ray hit; kNone: it left the scene
  uint32_t primitive;
  float u, v;  // barycentrics of vertices 1 and 2
  float distance;

  // The one shadow ray of this vertex, from `origin`; its contribution is added if it is
  // unoccluded. While the path's own ray is being traced, the place of its last hit instead: where
  // to look for more hits there if this one lets the ray through.
  union {
    float shadow_direction[3];
    LayerMark first_layer;
  };
  float shadow_distance;  // 0: none
  float shadow_radiance[3];
  uint32_t normal;  // shading normal at `origin`, octahedral 2 x 16 bit: light selection needs it
                    // again for MIS
};
static_assert(sizeof(PathState) == 128);

/// Asks for both cache lines of a path.
template <class Path>
void PrefetchPath(const Path* path) {
  __builtin_prefetch(path);
  __builtin_prefetch(&path->pixel);
}
static_assert(offsetof(PathState, pixel) == 64);

/// The paths of `count` slots from `first` on, as far as there are any.
template <class Path>
void PrefetchSlots(const Path* paths, std::span<const uint32_t> slots, size_t first, size_t count) {
  const size_t end = std::min(first + count, slots.size());
  for (size_t i = first; i < end; ++i) PrefetchPath(&paths[slots[i]]);
}

enum PathFlags : uint32_t {
  kPathDepthMask = 0x1ff,  // scattering events so far
  kPathLayerShift = 9,     // transparent layers passed since the last scattering event
  kPathLayerMask = 0x7ffu << 9,
  kPathAlive = 1u << 20,  // goes on after its shadow ray
};

constexpr uint32_t kLargestDepth = 256;
constexpr uint32_t kMaxAlphaLayers = 1024;

}  // namespace carpool::stages
