// Tells the story of one sample: every vertex of its path, as the kernels saw it.
#pragma once

#include <cstdint>
#include <string>

#include "render/base/error.h"
#include "render/session/settings.h"

namespace carpool::render {

/// Which sample is to be explained; pixels count from the top left corner.
struct SampleName {
  int x = 0, y = 0;
  uint32_t sample = 0;
};

/// Replays the path of one sample with the one-lane kernels, which give the bits of every executor,
/// and describes each vertex: where the ray came from and what it hit, the lobe, densities,
/// weights, the shadow ray, how far the next origin is from the hit, and the radiance so far.
/// Throws Error as Render does, and Error(usage) for a pixel outside the image.
std::string ExplainSample(const RenderSettings& settings, const SampleName& name,
                          const WarningSink& warn);

}  // namespace carpool::render
