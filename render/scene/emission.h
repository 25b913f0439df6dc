// Finds every triangle that emits, with an estimate of how much, for the light tree.
#pragma once

#include <vector>

#include "render/lights/light_tree.h"
#include "stages/tables/scene.h"

namespace carpool::render {

/// All triangles of the flat and instanced placements whose material is emissive, placement by
/// placement. Textures are averaged from a coarse mip level: the estimate steers light selection,
/// never the image's mean.
std::vector<TriangleEmission> CollectEmission(const stages::SceneTables& scene,
                                              const std::vector<int32_t>& triangles_of_placement);

}  // namespace carpool::render
