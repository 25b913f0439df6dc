// Checks, in debug builds, what kernels leave in the paths they were asked to work on.
#pragma once

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "stages/tables/path.h"

namespace carpool::stages {

/// Debug builds check; lanes that idle, and Embree, may compute what they like.
#ifdef NDEBUG
inline constexpr bool kCheckOutputs = false;
#else
inline constexpr bool kCheckOutputs = true;
#endif

/// What is wrong with a path that a kernel has left, or null: everything must be a number, the ray
/// that is to be traced a direction, and no weight negative. Radiance may be infinite: lights of
/// any strength are the film's ledger's business.
inline const char* FaultOf(const PathState& path) {
  const auto finite = [](const float v[3]) {
    return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
  };
  const auto weight = [&](const float v[3]) {
    return finite(v) && v[0] >= 0 && v[1] >= 0 && v[2] >= 0;
  };
  const auto unit = [](const float v[3]) {
    return std::abs(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] - 1) < 1e-4f;
  };
  if (!finite(path.origin)) return "origin";
  if (!unit(path.direction)) return "direction";
  if (!(path.pdf >= 0)) return "pdf";
  if (!weight(path.throughput)) return "throughput";
  for (const float r : path.radiance) {
    if (std::isnan(r)) return "radiance";
  }
  return nullptr;
}

/// Ends the program with the path's name if something is wrong with it.
inline void CheckOutput(const char* kernel, const PathState& path) {
  if (const char* const fault = FaultOf(path)) {
    std::fprintf(stderr, "carpool: %s kernel left a bad %s: pixel %u, sample %u\n", kernel, fault,
                 path.pixel, path.sample);
    std::abort();
  }
}

}  // namespace carpool::stages
