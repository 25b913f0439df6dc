// Lights chosen by the tree and chosen alike give the same picture, up to noise.
#include <gtest/gtest.h>

#include "tests/render/session/welch.h"

namespace carpool::test {
namespace {

/// A box with two lamps of unlike size and power, a point light and a sun through its open side.
std::filesystem::path ManyLights(const std::filesystem::path& folder) {
  SceneBuilder b;
  const int wall = b.AddLambert({0.7, 0.6, 0.5});
  const int bright = b.AddLambert({0, 0, 0}, {1, 0.9, 0.8}, 20);
  const int dim = b.AddLambert({0, 0, 0}, {0.3, 0.4, 1}, 1);
  b.PlaceMesh(b.AddQuad({-2, -1, 2}, {2, -1, 2}, {2, -1, -2}, {-2, -1, -2}, wall));
  b.PlaceMesh(b.AddQuad({-2, -1, -2}, {2, -1, -2}, {2, 2, -2}, {-2, 2, -2}, wall));
  b.PlaceMesh(b.AddQuad({0.8, 1.9, 0}, {1, 1.9, 0}, {1, 1.9, 0.2}, {0.8, 1.9, 0.2}, bright));
  b.PlaceMesh(b.AddQuad({-1.5, 1.9, -1}, {-0.5, 1.9, -1}, {-0.5, 1.9, 0}, {-1.5, 1.9, 0}, dim));
  b.PlaceMesh(b.AddSphere(0.5, 12, wall, false));
  b.json()["extensionsUsed"].push_back("KHR_lights_punctual");
  b.json()["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "point"}, {"intensity", 2}}, {{"type", "directional"}, {"intensity", 1}}};
  b.AddNode(
      {{"translation", {-1, 1, 1}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  b.AddNode({{"extensions", {{"KHR_lights_punctual", {{"light", 1}}}}}});
  b.AddCamera({0, 0.3, 4.5}, 0.7);
  return b.Write(folder, "lights");
}

class LightChoiceTest : public testing::TestWithParam<render::DirectLight> {};

// False alarms: see WelchT(). Seeds are fixed.
TEST_P(LightChoiceTest, ChangesOnlyTheNoise) {
  const ScratchFolder folder;
  render::RenderSettings tree;
  tree.scene_path = ManyLights(folder.path()).string();
  tree.width = tree.height = 48;
  tree.samples = 32;
  tree.max_depth = 3;
  tree.direct = GetParam();
  render::RenderSettings uniform = tree;
  uniform.lights = render::LightChoice::uniform;
  const Estimate a = EstimateMean(tree, 1), b = EstimateMean(uniform, 1001);
  EXPECT_GT(a.mean, 0.01);
  EXPECT_LT(std::abs(WelchT(a, b)), 6.5) << "tree " << a.mean << ", uniform " << b.mean;
  EXPECT_GT(RenderOnce(uniform).summary.noise, 1.1 * RenderOnce(tree).summary.noise);
}

INSTANTIATE_TEST_SUITE_P(Ways, LightChoiceTest,
                         testing::Values(render::DirectLight::mis, render::DirectLight::light),
                         [](const auto& info) { return std::string(render::Name(info.param)); });

}  // namespace
}  // namespace carpool::test
