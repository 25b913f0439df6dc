// Chooses where to divide a set of lights in two: the surface area orientation heuristic over
// buckets.
#pragma once

#include <cstddef>
#include <span>

#include "render/lights/light_cluster.h"

namespace carpool::render {

/// Reorders `lights` (at least two) and returns how many come first in the cheapest division found.
/// Past `deep`, or where all lights share one place, the halves are of equal size. Depends on the
/// input alone.
size_t SplitLights(std::span<LightCluster> lights, bool deep);

}  // namespace carpool::render
