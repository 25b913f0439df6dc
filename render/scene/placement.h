// Decides how each instance is put into the scene, baked or as an Embree instance, and makes the
// kernels' placements.
#pragma once

#include <string>
#include <vector>

#include "stages/tables/scene.h"

namespace carpool::render {

/// PlacementPlan tells the BVH build what was decided: each mesh instance is baked flat, or stays
/// an instance of its mesh.
struct PlacementPlan {
  struct Flat {
    int32_t placement = 0;  // its vertices are in world space
    int32_t shape = 0;      // where its counts are
  };
  struct Instanced {
    int32_t mesh = 0;             // shapes in object space
    int32_t first_placement = 0;  // placement of the mesh's first shape; the others follow
  };
  std::vector<Flat> flat;
  std::vector<Instanced> instanced;
  uint64_t flat_triangles = 0;
  uint64_t instanced_triangles = 0;  // as drawn
};

/// PlaceInstances fills `scene.geometry.placements` from shapes, meshes and instances, whose
/// matrices are already relative to `scene.origin`. Meshes used once are baked in place (one BVH
/// level is faster than two), small ones used often are copied, the rest is instanced and never
/// copied. Instances with a zero scale that leaves less than a plane vanish. Throws
/// InputError(`where`, ...) if there are more than stages::kMostVertices vertices, or 2^31 - 1
/// elements of another stream.
PlacementPlan PlaceInstances(stages::SceneTables& scene, const std::string& where);

}  // namespace carpool::render
