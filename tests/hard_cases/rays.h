// Experiments with single rays, for the rows about geometry and for the table of scales and
// offsets.
#pragma once

#include <cstdint>

#include "tests/hard_cases/loaded_case.h"

namespace carpool::test {

/// A closed sphere of 159,200 triangles around (offset, offset, offset); the camera, which
/// everything is relative to, stays at the origin.
SceneCase FarSphere(double radius, double offset);

/// How many of `rays` random rays from inside FarSphere leave it.
uint64_t CountLeaks(const LoadedCase& scene, double radius, double offset, uint64_t rays);

/// 300 random triangles of one size around a point at `offset` from the camera; needles are 10,000
/// times longer than wide.
SceneCase Soup(double size, double offset, bool needles);

/// What became of rays that were scattered off a soup's triangles.
struct Scattered {
  uint64_t rays = 0, self_hits = 0;
  double worst_offset = 0;  // of an origin from its hit point, over the stated bound
  uint64_t wrong_side = 0;  // origins behind the triangle's plane
};
Scattered ScatterAll(const LoadedCase& soup, double size, uint32_t rays);

}  // namespace carpool::test
