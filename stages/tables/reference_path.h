// The state of one path in double: what stages/tables/path.h is for the float kernels.
#pragma once

#include <cstdint>

namespace carpool::stages {

/// Member by member as PathState, each in 8 bytes, so that the kernels' offsets and groups of four
/// hold. Integers are in the low half; kNone keeps its sign.
struct ReferencePath {
  double origin[3];
  double tnear;
  double direction[3];
  double pdf;
  double throughput[3];
  double cone_width;
  double radiance[3];
  double cone_spread;

  uint64_t pixel;
  uint64_t sample;
  uint64_t flags;
  int64_t placement;  // kNone: the ray left the scene
  uint64_t primitive;
  double u, v;
  double distance;

  double shadow_direction[3];
  double shadow_distance;
  double shadow_radiance[3];
  uint64_t normal;
};
static_assert(sizeof(ReferencePath) == 256);

}  // namespace carpool::stages
