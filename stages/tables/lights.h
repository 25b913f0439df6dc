// Lights as the kernels read them: light records, the light tree over them, and the environment.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "stages/tables/huge_pages.h"

namespace carpool::stages {

enum class LightType : int32_t {
  triangle = 0,           // emits on the side of its geometric normal by the order of its vertices
  mirrored_triangle = 1,  // emits on the other side
  two_sided_triangle = 2,
  point = 3,
  spot = 4,
  directional = 5,
};
constexpr LightType kLastTriangleType = LightType::two_sided_triangle;
constexpr bool IsTriangle(LightType type) {
  return type <= kLastTriangleType;
}

/// What a light of KHR_lights_punctual is. World space relative to `SceneTables::origin`.
struct PunctualFields {
  float position[3] = {0, 0, 0};    // point, spot
  float range = 0;                  // point, spot: KHR_lights_punctual range; 0: infinite
  float direction[3] = {0, 0, -1};  // spot, directional: the way the light shines, unit length
  float cos_inner = 1;              // spot: cosines of the cone angles
  float intensity[3] = {0, 0, 0};   // point, spot: candela x colour; directional: lux x colour
  float cos_outer = 0;
};

/// What a triangle that emits is, so that sampling it needs nothing but its light: vertices in
/// world space in the order of the index stream, and the radiance that it has everywhere. Red below
/// 0: its radiance varies, ask the material.
struct TriangleFields {
  float p0[3], red;
  float p1[3], green;
  float p2[3], blue;
};

/// One light: 16 words.
struct alignas(64) Light {
  LightType type = LightType::triangle;
  int32_t placement = 0;  // triangle: which placement ...
  int32_t primitive = 0;  // ... and which of its triangles
  int32_t leaf = -1;      // its leaf's index in the light tree; -1: not in the tree (directional)
  union {
    PunctualFields punctual = {};
    TriangleFields triangle;
  };
};
static_assert(sizeof(Light) == 64);

/// A cosine, sine or component of a direction as a multiple of 1 / kFixedOne, in 16 bits.
constexpr float kFixedOne = 32767;
constexpr float FromFixed(int16_t value) {
  return static_cast<float>(value) / kFixedOne;
}
/// The upper half of a float: its sign, exponent and 7 bits of mantissa (bfloat16).
constexpr float FromUpperHalf(uint16_t upper) {
  return std::bit_cast<float>(static_cast<uint32_t>(upper) << 16);
}

/// A node of the light tree: a cluster of lights. 8 words, so that siblings share a cache line. The
/// root is node 0; node 1 is unused, so that siblings are a pair (2k, 2k + 1) and each finds the
/// other by flipping the lowest bit.
struct alignas(32) LightNode {
  float center[3] = {0, 0, 0};  // sphere around everything that emits ...
  int16_t cos_theta_e = 0;      // bound on the emission angle about a normal, rounded down
  uint16_t radius = 0;          // ... upper half, rounded up
  int16_t axis[3] = {0, 0, 0};  // cone of emission normals (Conty Estevez & Kulla 2018)
  int16_t cos_theta_o = 0;      // bound on the angle between an emitter's normal and the axis,
  int16_t sin_theta_o = 0;      // rounded down and up
  uint16_t signed_power = 0;  // upper half of candela of luminance, summed, as a share of the whole
                              // tree's; negative: the cone's opposite counts as well (two-sided
                              // emitters)
  int32_t child_or_light = -1;  // inner: the left child, the right one follows it; leaf: ~light
};
static_assert(sizeof(LightNode) == 32);
// Kernels take two halves from one word.
static_assert(std::endian::native == std::endian::little);

/// Selection masses of an environment table are integers whose sum is this: the grid of a 24-bit
/// float in [0, 1), so that a table is inverted without any rounding.
constexpr int32_t kEnvironmentMass = 1 << 24;
constexpr int32_t kTablePadding = 3;  // words behind each table below: kernels load four at once

/// Inverting a table starts from its guide (Chen & Asau 1974, "On Generating Random Variates from
/// an Empirical Distribution"): numbers are divided into 2^bits equal cells, and entry k of the
/// guide is where a search for the first number of cell k ends; one more entry is for the last
/// number of all. With about as many cells as entries most searches end where they begin.
constexpr int32_t GuideBits(int32_t count) {
  return std::bit_width(static_cast<uint32_t>(count)) - 1;
}
constexpr int32_t GuideSize(int32_t count) {
  return (1 << GuideBits(count)) + 1;
}

/// Lat-long environment map. Radiance is bilinear between texel centres, wrapping in u, clamped in
/// v; direction (x, y, z) is at u = 1/2 + atan2(x, -z) / 2 pi, v = acos(y) / pi (glTF's -Z is the
/// middle).
struct Environment {
  int32_t width = 0;  // 0: no environment
  int32_t height = 0;
  /// 4 floats a texel: RGB in cd/m2, finite and >= 0, then P(row) P(column | row), the probability
  /// that sampling selects this texel: > 0 wherever RGB is. At most 2^29 texels.
  UnsetHugeVector<float> texels;
  /// Behind each of these are kTablePadding words more.
  UnsetHugeVector<int32_t> row_cdf;       // height + 1: mass of the rows before each, and of all
  UnsetHugeVector<int32_t> column_cdf;    // height * (width + 1): the same within each row
  UnsetHugeVector<int32_t> row_guide;     // GuideSize(height)
  UnsetHugeVector<int32_t> column_guide;  // height * GuideSize(width)
};

struct LightTables {
  HugeVector<Light> lights;     // triangle lights first, in placement order; then punctual ones
  HugeVector<LightNode> nodes;  // depth-first; empty: no light in the tree
  HugeVector<int32_t> parents;  // k: the parent of nodes 2k and 2k + 1; -1 at the root
  std::vector<int32_t> infinite_lights;  // indices of directional lights
  Environment environment;
  float tree_probability = 0;         // of choosing the tree, each infinite light, the environment:
  float infinite_probability = 0;     // tree + infinite * infinite_lights.size() + environment = 1
  float environment_probability = 0;  // (all 0 where there is no light)
};

}  // namespace carpool::stages
