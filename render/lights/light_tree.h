// Turns everything in a scene that emits into light records and the tree that picks among them.
#pragma once

#include <cstdint>
#include <span>

#include "stages/tables/scene.h"

namespace carpool::render {

/// One emissive triangle, in world space relative to `SceneTables::origin`.
struct TriangleEmission {
  int32_t placement = 0;
  int32_t primitive = 0;
  float p0[3] = {0, 0, 0}, p1[3] = {0, 0, 0},
        p2[3] = {0, 0, 0};        // in the order of the index stream
  float radiance[3] = {1, 1, 1};  // cd/m2, unless a texture makes it vary
  bool varies = false;
  float radiance_luminance = 0;  // mean over the triangle, cd/m2
  bool two_sided = false;
};

/// A light of KHR_lights_punctual, placed in the world.
struct PunctualInput {
  stages::LightType type = stages::LightType::point;  // point, spot or directional
  float position[3] = {0, 0, 0};
  float direction[3] = {0, 0, -1};  // the way it shines, any length above 0
  float intensity[3] = {1, 1, 1};   // colour x candela (point, spot) or x lux (directional)
  float range = 0;                  // 0: infinite
  float inner_cone = 0;             // radians, spot only
  float outer_cone = 0.785398163f;
};

/// Fills scene.lights (all but its environment, which must be there already), and first_light of
/// the placements that have emissive triangles.
///
/// `triangles` come placement by placement, and within one all triangles from primitive 0 on
/// (otherwise std::invalid_argument), so that Placement::first_light + primitive is a triangle's
/// light. Black or degenerate triangles have a record and no leaf: they are never picked, and so
/// are punctual lights without intensity.
///
/// Which kind of light a sample goes to: half of the samples equally among the kinds that are
/// present, half in proportion to the irradiance they are estimated to cause at the camera. The
/// first half bounds what an estimate that is far off (a wall in the way) can cost.
void BuildLightTree(stages::SceneTables& scene, std::span<const TriangleEmission> triangles,
                    std::span<const PunctualInput> punctual);

}  // namespace carpool::render
