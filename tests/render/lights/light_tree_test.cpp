// The light tree as built: one leaf per light, clusters that hold their lights, the same for any
// thread count.
#include "render/lights/light_tree.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "render/lights/environment.h"

namespace carpool::render {
namespace {

using stages::Light;
using stages::LightNode;
using stages::LightType;
using stages::SceneTables;

struct Input {
  std::vector<TriangleEmission> triangles;
  std::vector<PunctualInput> punctual;
};

Input RandomInput(int triangles, int punctual, uint32_t seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<float> place(-50, 50), small(-0.1f, 0.1f), power(-6, 6);
  Input input;
  for (int i = 0; i < triangles; ++i) {
    TriangleEmission t;
    t.primitive = i;
    t.radiance_luminance = std::pow(10.0f, power(rng));
    t.two_sided = i % 3 == 0;
    for (int k = 0; k < 3; ++k) {
      const float center = place(rng);
      t.p0[k] = center + small(rng);
      t.p1[k] = center + small(rng);
      t.p2[k] = center + small(rng);
    }
    input.triangles.push_back(t);
  }
  for (int i = 0; i < punctual; ++i) {
    PunctualInput p;
    p.type = i % 2 == 0 ? LightType::point : LightType::spot;
    for (float& c : p.position) c = place(rng);
    for (float& c : p.direction) c = small(rng);
    input.punctual.push_back(p);
  }
  return input;
}

SceneTables Built(const Input& input, size_t placements = 1) {
  SceneTables scene;
  scene.geometry.placements.resize(placements);
  BuildLightTree(scene, input.triangles, input.punctual);
  return scene;
}

double Distance(const float a[3], const float b[3]) {
  return std::hypot(double{a[0]} - b[0], double{a[1]} - b[1], double{a[2]} - b[2]);
}

float Power(const LightNode& n) {
  return stages::FromUpperHalf(n.signed_power);
}
double ConeAngle(const LightNode& n) {
  return std::acos(double{stages::FromFixed(n.cos_theta_o)});
}
/// What the cone's angle was at least, before its cosine was rounded down.
double LeastConeAngle(const LightNode& n) {
  return std::acos(std::min((n.cos_theta_o + 1.0) / stages::kFixedOne, 1.0));
}
double AngleBetween(const LightNode& a, const LightNode& b) {
  double sine = 0, cosine = 0;
  for (int i = 0; i < 3; ++i) {
    const int k = (i + 1) % 3;
    const double cross = 1.0 * a.axis[i] * b.axis[k] - 1.0 * a.axis[k] * b.axis[i];
    sine += cross * cross;
    cosine += 1.0 * a.axis[i] * b.axis[i];
  }
  return std::atan2(std::sqrt(sine), cosine);
}

/// Checks the subtree at `node`; returns its number of leaves and deepens `depth` to the deepest.
int CheckSubtree(const stages::LightTables& tables, int32_t node, int level, int& depth) {
  const LightNode& n = tables.nodes[static_cast<size_t>(node)];
  depth = std::max(depth, level);
  if (n.child_or_light < 0) {
    EXPECT_EQ(tables.lights[static_cast<size_t>(~n.child_or_light)].leaf, node);
    return 1;
  }
  EXPECT_EQ(n.child_or_light % 2, 0);
  int leaves = 0;
  float power = 0;
  for (int32_t child = n.child_or_light; child < n.child_or_light + 2; ++child) {
    const LightNode& c = tables.nodes[static_cast<size_t>(child)];
    EXPECT_EQ(tables.parents[static_cast<size_t>(child) / 2], node);
    EXPECT_LE(n.cos_theta_e, c.cos_theta_e);
    EXPECT_TRUE(Power(n) < 0 || Power(c) > 0);
    // The child's cone is within the parent's, or its opposite if that counts.
    double between = AngleBetween(c, n);
    if (Power(n) < 0) between = std::min(between, std::acos(-1.0) - between);
    const double outermost = between + LeastConeAngle(c);
    EXPECT_LE(std::min(outermost, std::acos(-1.0)), ConeAngle(n) + 1e-3);
    power += std::abs(Power(c));
    leaves += CheckSubtree(tables, child, level + 1, depth);
  }
  EXPECT_NEAR(power / std::abs(Power(n)), 1, 0x1.02p-7);  // each rounded to 8 bits
  return leaves;
}

/// Every cluster from the light's leaf to the root has the point in its sphere.
void CheckAncestors(const stages::LightTables& tables, size_t light, const float point[3]) {
  for (int32_t node = tables.lights[light].leaf; node >= 0;) {
    const LightNode& n = tables.nodes[static_cast<size_t>(node)];
    ASSERT_LE(Distance(point, n.center), stages::FromUpperHalf(n.radius))
        << "light " << light << ", node " << node;
    node = tables.parents[static_cast<size_t>(node) / 2];
  }
}

TEST(LightTreeBuild, EveryLightHasOneLeafAndEveryClusterHoldsItsOwn) {
  const Input input = RandomInput(4000, 1000, 1);
  const SceneTables scene = Built(input);
  for (size_t i = 0; i < 4000; ++i) {
    CheckAncestors(scene.lights, i, input.triangles[i].p0);
    CheckAncestors(scene.lights, i, input.triangles[i].p1);
    CheckAncestors(scene.lights, i, input.triangles[i].p2);
  }
  for (size_t i = 0; i < 1000; ++i) {
    CheckAncestors(scene.lights, 4000 + i, input.punctual[i].position);
  }
  int depth = 0;
  EXPECT_EQ(CheckSubtree(scene.lights, 0, 0, depth), 5000);
  EXPECT_EQ(scene.lights.nodes.size(), 10000u);
  EXPECT_EQ(scene.lights.parents.size(), 5000u);
  EXPECT_EQ(scene.lights.parents[0], -1);
  EXPECT_EQ(std::abs(Power(scene.lights.nodes[0])), 1);
  EXPECT_LT(depth, 33 + 13);
}

TEST(LightTreeBuild, IsTheSameForAnyThreadCount) {
  const Input input = RandomInput(20000, 5000, 2);
  const SceneTables all = Built(input);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const SceneTables serial = Built(input);
  ASSERT_EQ(all.lights.nodes.size(), serial.lights.nodes.size());
  EXPECT_EQ(std::memcmp(all.lights.nodes.data(), serial.lights.nodes.data(),
                        all.lights.nodes.size() * sizeof(LightNode)),
            0);
  EXPECT_EQ(std::memcmp(all.lights.lights.data(), serial.lights.lights.data(),
                        all.lights.lights.size() * sizeof(Light)),
            0);
}

TEST(LightTreeBuild, PlacementsFindTheirLights) {
  Input input = RandomInput(7, 1, 3);
  for (size_t i = 0; i < 7; ++i) {
    input.triangles[i].placement = i < 4 ? 1 : 3;
    input.triangles[i].primitive = static_cast<int32_t>(i < 4 ? i : i - 4);
  }
  const SceneTables scene = Built(input, 5);
  const int32_t expected[] = {-1, 0, -1, 4, -1};
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(scene.geometry.placements[i].first_light, expected[i]) << i;
  }
  for (size_t i = 0; i < 7; ++i) {
    EXPECT_EQ(scene.lights.lights[i].placement, input.triangles[i].placement);
    EXPECT_EQ(scene.lights.lights[i].primitive, input.triangles[i].primitive);
  }
}

TEST(LightTreeBuild, TrianglesOutOfOrderAreRefused) {
  Input input = RandomInput(3, 0, 4);
  input.triangles[1].primitive = 2;
  EXPECT_THROW(Built(input), std::invalid_argument);
  input = RandomInput(3, 0, 4);
  input.triangles[2].placement = 9;
  input.triangles[2].primitive = 0;
  EXPECT_THROW(Built(input), std::invalid_argument);
}

TEST(LightTreeBuild, WhatCannotShineHasARecordAndNoLeaf) {
  Input input = RandomInput(6, 3, 5);
  input.triangles[0].radiance_luminance = 0;
  std::copy(input.triangles[1].p0, input.triangles[1].p0 + 3, input.triangles[1].p1);
  input.triangles[2].p2[1] = std::numeric_limits<float>::quiet_NaN();
  input.triangles[3].radiance_luminance = std::numeric_limits<float>::infinity();
  for (float& c : input.punctual[0].intensity) c = 0;
  const SceneTables scene = Built(input);
  const bool shines[] = {false, false, false, false, true, true, false, true, true};
  for (size_t i = 0; i < 9; ++i) EXPECT_EQ(scene.lights.lights[i].leaf >= 0, shines[i]) << i;
  EXPECT_EQ(scene.lights.nodes.size(), 8u);
}

TEST(LightTreeBuild, NothingButBlackGivesNoTree) {
  Input input = RandomInput(4, 0, 6);
  for (TriangleEmission& t : input.triangles) t.radiance_luminance = 0;
  const SceneTables scene = Built(input);
  EXPECT_TRUE(scene.lights.nodes.empty());
  EXPECT_EQ(scene.lights.tree_probability, 0);
  EXPECT_EQ(scene.lights.lights.size(), 4u);
}

/// Lights that no plane divides, or that any plane divides badly.
TEST(LightTreeBuild, StaysShallowForHardPlaces) {
  Input same = RandomInput(0, 10000, 7), geometric = same, line = same;
  for (size_t i = 0; i < 10000; ++i) {
    for (int k = 0; k < 3; ++k) {
      same.punctual[i].position[k] = 1;
      geometric.punctual[i].position[k] =
          k == 0 ? std::ldexp(1.0f, static_cast<int>(i % 250) - 125) : 0;
      line.punctual[i].position[k] = k == 0 ? static_cast<float>(i) : 0;
    }
  }
  for (const Input* input : {&same, &geometric, &line}) {
    const SceneTables scene = Built(*input);
    int depth = 0;
    EXPECT_EQ(CheckSubtree(scene.lights, 0, 0, depth), 10000);
    EXPECT_LE(depth, 33 + 14);
  }
}

TEST(LightTreeBuild, KindsOfLightShareAsStated) {
  Input input = RandomInput(0, 3, 8);
  for (size_t i = 1; i < 3; ++i) {
    input.punctual[i].type = LightType::directional;
    for (float& c : input.punctual[i].intensity) c = 2;  // together 4 lux
  }
  input.punctual[0].type = LightType::point;
  const float at[3] = {3, 0, 4};
  for (int i = 0; i < 3; ++i) {
    input.punctual[0].position[i] = at[i];
    input.punctual[0].intensity[i] = 100;  // 4 lux at the origin
  }
  SceneTables scene;
  scene.geometry.placements.resize(1);
  BuildEnvironment(scene.lights.environment, 2, 1,
                   std::vector<float>(6, static_cast<float>(8 / std::acos(-1.0))));  // 8 lux
  BuildLightTree(scene, input.triangles, input.punctual);
  EXPECT_NEAR(scene.lights.tree_probability, 1.0 / 6 + 0.5 * 4 / 16, 1e-6);
  EXPECT_NEAR(scene.lights.infinite_probability, (1.0 / 6 + 0.5 * 4 / 16) / 2, 1e-6);
  EXPECT_NEAR(scene.lights.environment_probability, 1.0 / 6 + 0.5 * 8 / 16, 1e-6);
  EXPECT_EQ(scene.lights.infinite_lights, (std::vector<int32_t>{1, 2}));
}

TEST(LightTreeBuild, RebuildingStartsAfresh) {
  const Input input = RandomInput(10, 2, 9);
  SceneTables scene = Built(input);
  BuildLightTree(scene, input.triangles, input.punctual);
  EXPECT_EQ(scene.lights.lights.size(), 12u);
  EXPECT_EQ(scene.lights.nodes.size(), 24u);
}

}  // namespace
}  // namespace carpool::render
