// Lights as the kernels read them: light records, the light tree over them, and the environment.
#pragma once

#include <cstdint>
#include <vector>

namespace carpool::stages {

enum class LightType : int32_t { triangle = 0, point = 1, spot = 2, directional = 3 };

/// One light: 16 words. Positions and directions are world space relative to `SceneTables::origin`.
struct alignas(64) Light {
  LightType type = LightType::triangle;
  int32_t placement = 0;         // triangle: which placement ...
  int32_t primitive = 0;         // ... and which of its triangles
  int32_t leaf = -1;             // its leaf's index in the light tree; -1: not in the tree (directional)
  float position[3] = {0, 0, 0}; // point, spot
  float range = 0;               // point, spot: KHR_lights_punctual range; 0: infinite
  float direction[3] = {0, 0, -1};  // spot, directional: the way the light shines, unit length
  float cos_inner = 1;           // spot: cosines of the cone angles
  float intensity[3] = {0, 0, 0};  // point, spot: candela x colour; directional: lux x colour
  float cos_outer = 0;
};
static_assert(sizeof(Light) == 64);

/// A node of the light tree; its layout belongs to render/lights (builder) and
/// stages/kernels/light_tree-inl.h (reader). 16 words.
struct alignas(64) LightNode {
  float bounds_min[3];
  int32_t child_or_light;  // inner: index of the right child (the left one follows its parent);
                           // leaf: ~light index
  float bounds_max[3];
  int32_t parent;          // -1 at the root
  float axis[3];           // cone of emission normals (Conty Estevez & Kulla 2018)
  float cos_theta_o;       // bound on the angle between an emitter's normal and the axis
  float power;             // sum over the subtree, luminance-weighted
  float cos_theta_e;       // bound on the emission angle about a normal
  int32_t two_sided;
  int32_t pad;
};
static_assert(sizeof(LightNode) == 64);

/// Lat-long environment map. Radiance is bilinear between texel centres, wrapping in u, clamped in v;
/// direction (x, y, z) is at u = 1/2 + atan2(x, -z) / 2 pi, v = acos(y) / pi (glTF's -Z is the middle).
/// Selection probabilities are exact: integer masses whose total is 2^32 per table.
struct Environment {
  int32_t width = 0;  // 0: no environment
  int32_t height = 0;
  std::vector<float> texels;             // RGB, width * height * 3, cd/m2, finite and >= 0
  std::vector<uint32_t> row_cdf;         // height entries: exclusive cumulative mass of rows
  std::vector<uint32_t> column_cdf;      // width * height: exclusive cumulative mass within each row
  std::vector<float> texel_probability;  // width * height: P(row) P(column | row) as selected
};

struct LightTables {
  std::vector<Light> lights;             // triangle lights first, in placement order; then punctual ones
  std::vector<LightNode> nodes;          // depth-first; empty: no light in the tree
  std::vector<int32_t> infinite_lights;  // indices of directional lights
  Environment environment;
  float tree_probability = 0;         // of choosing the tree, each infinite light, the environment:
  float infinite_probability = 0;     // tree + infinite * infinite_lights.size() + environment = 1
  float environment_probability = 0;  // (all 0 where there is no light)
};

}  // namespace carpool::stages
