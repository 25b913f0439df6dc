// Morph targets with default weights, and skins in their rest pose.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/render/gltf/scene_builder.h"

namespace carpool::render {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

/// A triangle with two morph targets: x + 1 for all, and y + 1 for all.
SceneBuilder Morphed() {
  SceneBuilder scene;
  scene.AddTriangle();
  const int x = scene.AddAccessor<float>("VEC3", {1, 0, 0, 1, 0, 0, 1, 0, 0});
  const int y = scene.AddAccessor<float>("VEC3", {0, 1, 0, 0, 1, 0, 0, 1, 0});
  scene.json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", x}}, {{"POSITION", y}}};
  return scene;
}

TEST(Morph, DefaultWeightsOfTheMesh) {
  SceneBuilder scene = Morphed();
  EXPECT_THAT(Positions(Load(scene)), ElementsAre(0, 0, 0, 1, 0, 0, 0, 1, 0));
  scene.json["meshes"][0]["weights"] = {2, 0.5};
  EXPECT_THAT(Positions(Load(scene)), ElementsAre(2, 0.5f, 0, 3, 0.5f, 0, 2, 1.5f, 0));
}

TEST(Morph, WeightsOfANodeGoBeforeThoseOfTheMesh) {
  SceneBuilder scene = Morphed();
  scene.json["meshes"][0]["weights"] = {2, 0.5};
  scene.json["nodes"][0]["weights"] = {0, 1};
  scene.AddNode({{"mesh", 0}});
  scene.AddNode({{"mesh", 0}});
  const ImportedScene imported = Load(scene);
  ASSERT_THAT(imported.geometry.meshes, SizeIs(2));  // the last two nodes share one
  EXPECT_THAT(Positions(imported, 0), ElementsAre(0, 1, 0, 1, 1, 0, 0, 2, 0));
  EXPECT_THAT(Positions(imported, 1), ElementsAre(2, 0.5f, 0, 3, 0.5f, 0, 2, 1.5f, 0));
  EXPECT_EQ(imported.geometry.instances[1].mesh, imported.geometry.instances[2].mesh);
}

TEST(Morph, NormalsMoveToo) {
  SceneBuilder scene = Morphed();
  Json& primitive = scene.json["meshes"][0]["primitives"][0];
  primitive["attributes"]["NORMAL"] = scene.AddAccessor<float>("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1});
  primitive["targets"][0]["NORMAL"] =
      scene.AddAccessor<float>("VEC3", {3, 0, 3, 0, 0, 0, 0, 0, -2});
  scene.json["meshes"][0]["weights"] = {1, 0};
  const ImportedScene imported = Load(scene);
  const std::vector<float> normals = Normals(imported);
  EXPECT_FLOAT_EQ(normals[0], 0.6f);
  EXPECT_FLOAT_EQ(normals[2], 0.8f);
  EXPECT_EQ(normals[8], -1);
}

TEST(Morph, TargetsOfAnotherSizeAreRefused) {
  SceneBuilder scene = Morphed();
  const int wrong = scene.AddAccessor<float>("VEC3", {1, 2, 3});
  scene.json["meshes"][0]["primitives"][0]["targets"][1]["POSITION"] = wrong;
  scene.json["meshes"][0]["weights"] = {0, 1};
  EXPECT_THAT(ErrorOf(scene),
              HasSubstr("/meshes/0/primitives/0/targets/1/POSITION: does not match"));
}

/// A triangle on two joints: node 1 at x = 100 and its child, node 2, at y = 10 above it. The first
/// two vertices hang on the first joint, the third on both.
SceneBuilder Skinned() {
  SceneBuilder scene;
  scene.AddTriangle();
  Json& attributes = scene.json["meshes"][0]["primitives"][0]["attributes"];
  attributes["JOINTS_0"] = scene.AddAccessor<uint8_t>("VEC4", {0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0});
  attributes["WEIGHTS_0"] =
      scene.AddAccessor<uint8_t>("VEC4", {255, 0, 0, 0, 255, 0, 0, 0, 128, 128, 0, 0}, true);
  scene.AddNode({{"translation", {100, 0, 0}}, {"children", {2}}});
  scene.AddNode({{"translation", {0, 10, 0}}}, false);
  scene.json["skins"] = {{{"joints", {1, 2}}}};
  scene.json["nodes"][0]["skin"] = 0;
  scene.json["nodes"][0]["translation"] = {-777, 0, 0};  // must not count
  return scene;
}

/// World positions of the only instance.
std::vector<float> WorldPositions(const ImportedScene& scene) {
  std::vector<float> positions = Positions(scene);
  const Affine& world = scene.geometry.instances.at(0).object_to_world;
  for (size_t i = 0; i < positions.size(); ++i)
    positions[i] += static_cast<float>(world[i % 3 * 4 + 3]);
  return positions;
}

TEST(Skin, PlacesVerticesByTheirJoints) {
  const ImportedScene imported = Load(Skinned());
  ASSERT_THAT(imported.geometry.instances, SizeIs(1));
  EXPECT_EQ(imported.geometry.instances[0].object, 1);
  EXPECT_THAT(WorldPositions(imported), ElementsAre(100, 0, 0, 101, 0, 0, 100, 6, 0));
}

TEST(Skin, InverseBindMatricesUndoTheBindPose) {
  SceneBuilder scene = Skinned();
  scene.json["skins"][0]["inverseBindMatrices"] =
      scene.AddAccessor<float>("MAT4", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -100, 0,   0, 1,
                                        1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -100, -10, 0, 1});
  EXPECT_THAT(WorldPositions(Load(scene)), ElementsAre(0, 0, 0, 1, 0, 0, 0, 1, 0));
}

TEST(Skin, FarFromTheOriginKeepsItsShape) {
  SceneBuilder scene = Skinned();
  scene.json["nodes"][1]["translation"] = {1e9, 0, 0};
  const ImportedScene imported = Load(scene);
  EXPECT_THAT(Positions(imported), ElementsAre(0, 0, 0, 1, 0, 0, 0, 6, 0));
  EXPECT_EQ(imported.geometry.instances.at(0).object_to_world[3], 1e9);
}

TEST(Skin, BrokenOnesAreRefused) {
  SceneBuilder scene = Skinned();
  scene.json["skins"][0]["joints"] = {1};
  EXPECT_THAT(ErrorOf(scene),
              HasSubstr("/meshes/0/primitives/0/attributes/JOINTS_0: vertex 2 refers to a joint"));
  scene.json["skins"][0]["joints"] = Json::array();
  EXPECT_THAT(ErrorOf(scene), HasSubstr("/skins/0/joints: is empty"));
  scene = Skinned();
  scene.json["skins"][0]["inverseBindMatrices"] = 0;
  EXPECT_THAT(ErrorOf(scene),
              HasSubstr("/skins/0/inverseBindMatrices: must be one MAT4 per joint"));
  scene = Skinned();
  scene.json["skins"][0]["joints"] = {1, 99};
  EXPECT_THAT(ErrorOf(scene), HasSubstr("/skins/0/joints/1: refers to nodes 99"));
}

TEST(Skin, UnweightedVerticesStayWithTheFirstJoint) {
  SceneBuilder scene = Skinned();
  scene.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] =
      scene.AddAccessor<float>("VEC4", std::vector<float>(12, 0.0f));
  EXPECT_THAT(WorldPositions(Load(scene)), ElementsAre(100, 0, 0, 101, 0, 0, 100, 1, 0));
}

}  // namespace
}  // namespace carpool::render
