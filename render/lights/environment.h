// Turns the pixels of a lat-long image into an environment map that can be sampled.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/tables/lights.h"

namespace carpool::render {

/// What `BuildEnvironment` had to replace, for the caller to warn about.
struct EnvironmentReport {
  int64_t invalid = 0;  // NaN or negative components, now 0
  int64_t infinite =
      0;  // infinite components, now 65504: the largest half, which most likely overflowed
};

/// `rgb` holds width x height linear pixels from the top row down, the first at u = 0, v = 0. Both
/// sizes are at least 1 and their product at most 2^29; a width or height above 2^24 is refused
/// (std::invalid_argument).
///
/// The density of sampling is the bilinear interpolation of what texels are selected with:
/// luminance x sin(theta) at the texel's centre, rounded to integer masses. An all-black map
/// selects nothing.
EnvironmentReport BuildEnvironment(stages::Environment& environment, int width, int height,
                                   std::vector<float> rgb);

/// Mean luminance over the sphere, in cd/m2.
double MeanLuminance(const stages::Environment& environment);

}  // namespace carpool::render
