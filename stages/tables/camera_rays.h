// Camera rays before they are paths: arrays, as lanes make them and packets trace them. Those that
// see the background end here; only what hits something becomes a path.
#pragma once

#include <cstdint>

#include "stages/tables/path.h"

namespace carpool::stages {

constexpr uint32_t kCameraGroup = 8;  // neighbouring places that are traced as one packet

/// Up to kMost rays in whole groups. The places of a group that are outside the image idle: nothing
/// is said of their rays.
struct CameraRays {
  static constexpr uint32_t kMost = 64;

  uint32_t count = 0;                      // places in use, from 0 on: a multiple of kCameraGroup
  float cone_width, cone_spread;           // of all: at the origin (metres), and growth per metre
  alignas(64) uint32_t pixel[kMost] = {};  // y * width + x
  uint32_t sample[kMost] = {};
  int32_t inside[kMost];  // -1: the pixel is in the image; 0: the place idles
  float origin[3][kMost];
  float direction[3][kMost];  // unit length
  float radiance[3][kMost];   // that the ray brings if it hits nothing

  // What the ray hits; kNone: nothing.
  int32_t placement[kMost];
  uint32_t primitive[kMost];
  float u[kMost], v[kMost];  // barycentrics of vertices 1 and 2
  float distance[kMost];
};

/// The path whose first ray is at place `i`, once it was traced.
inline void StartPath(const CameraRays& rays, uint32_t i, PathState& path) {
  for (int c = 0; c < 3; ++c) {
    path.origin[c] = rays.origin[c][i];
    path.direction[c] = rays.direction[c][i];
    path.throughput[c] = 1;
    path.radiance[c] = 0;
  }
  path.tnear = 0;
  path.pdf = 0;
  path.cone_width = rays.cone_width;
  path.cone_spread = rays.cone_spread;
  path.pixel = rays.pixel[i];
  path.sample = rays.sample[i];
  path.flags = 0;
  path.placement = rays.placement[i];
  path.primitive = rays.primitive[i];
  path.u = rays.u[i];
  path.v = rays.v[i];
  path.distance = rays.distance[i];
  path.first_layer = {path.placement, path.primitive, path.distance};
  path.shadow_distance = 0;
}

}  // namespace carpool::stages
