// Random variations of scenes that leave their images the same, and random scenes whose image is
// known: what the soak renders.
#pragma once

#include <random>

#include "tests/hard_cases/scenes.h"

namespace carpool::test {

/// Where a scene was put, and how much brighter it became.
struct Variation {
  double scale = 1;       // 1e-6 to 1e6
  double offset = 0;      // metres from the origin, up to 1e6
  double brightness = 1;  // of every light
  std::string Text() const;
};

/// Scales, moves and (but for scenes with a sky that is not uniform) turns everything, camera
/// included, and multiplies every light, so that pixels, `expected` bright until now, get any
/// brightness from 1e-7 to 1e5. All at random, as far as node matrices in double can hold it.
Variation Vary(SceneCase& scene, double expected, std::mt19937& rng);

/// Row 16 with any roughness down to 0 and any metallic share.
ClosedForm RandomWhiteSphere(std::mt19937& rng);

/// Row 12 with anything in the furnace: triangles of all sizes, needles, spheres, some of them
/// around or through the camera.
ClosedForm RandomFurnace(std::mt19937& rng);

/// Row 33: a dome of a million triangle lights over twelve decades of radiance; `rings` of 2
/// `rings` quadrilaterals each.
ClosedForm DomeOfLights(int rings, std::mt19937& rng);

}  // namespace carpool::test
