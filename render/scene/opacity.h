// Finds materials that ask for alpha but are opaque everywhere, so that nothing is simulated for
// them.
#pragma once

#include <vector>

#include "stages/tables/geometry.h"
#include "stages/tables/materials.h"

namespace carpool::render {

/// Sets alpha_mode to opaque where factor, texture and vertex colours can only give an opacity
/// of 1.
void SimplifyOpacity(std::vector<stages::Material>& materials,
                     const stages::TextureTables& textures, const stages::GeometryTables& geometry);

}  // namespace carpool::render
