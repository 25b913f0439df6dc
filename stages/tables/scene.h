// Everything the kernels may read of a scene, as plain tables; filled by render/, immutable while
// rendering.
#pragma once

#include <array>
#include <vector>

#include "stages/tables/camera.h"
#include "stages/tables/geometry.h"
#include "stages/tables/lights.h"
#include "stages/tables/materials.h"

namespace carpool::stages {

struct SceneTables {
  /// World position (double) that all float coordinates are relative to: the render camera's place,
  /// so that precision is best near the eye.
  std::array<double, 3> origin = {0, 0, 0};
  Camera camera;
  GeometryTables geometry;
  std::vector<Material> materials;
  TextureTables textures;
  LightTables lights;
};

}  // namespace carpool::stages
