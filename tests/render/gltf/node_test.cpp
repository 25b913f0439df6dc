// Nodes: transforms in double, hierarchy, scenes, instances, cameras and lights.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/render/gltf/scene_builder.h"

namespace carpool::render {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pointwise;
using ::testing::SizeIs;

constexpr double kHalf = 0.70710678118654752;  // sine and cosine of 45 degrees

void ExpectWorld(const Affine& world, const Affine& expected) {
  EXPECT_THAT(world, Pointwise(DoubleNear(1e-12), expected));
}

TEST(Node, TranslationRotationScale) {
  SceneBuilder scene;
  scene.AddTriangle();
  // A quarter turn about z takes x to y; the scale acts before it.
  scene.json["nodes"][0]["translation"] = {10, 20, 30};
  scene.json["nodes"][0]["rotation"] = {0, 0, kHalf, kHalf};
  scene.json["nodes"][0]["scale"] = {2, 3, -4};
  const ImportedScene imported = Load(scene);
  ExpectWorld(imported.geometry.instances.at(0).object_to_world,
              {0, -3, 0, 10, 2, 0, 0, 20, 0, 0, -4, 30});
}

TEST(Node, MatricesAreColumnMajor) {
  SceneBuilder scene;
  scene.AddTriangle();
  scene.json["nodes"][0]["matrix"] = {1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0, 10, 11, 12, 1};
  const ImportedScene imported = Load(scene);
  ExpectWorld(imported.geometry.instances.at(0).object_to_world,
              {1, 4, 7, 10, 2, 5, 8, 11, 3, 6, 9, 12});
}

TEST(Node, ChildrenKeepTheirPrecisionFarAway) {
  // In float, 1e8 + 0.25 is 1e8; a parent that brings it back must find the quarter again.
  SceneBuilder scene;
  scene.AddTriangle();
  scene.json["scenes"][0]["nodes"] = {2};
  scene.json["nodes"][0]["translation"] = {100000000.25, 0, 0};
  scene.AddNode({{"children", {0}}, {"translation", {-100000000, 0, 0}}}, false);
  scene.AddNode({{"children", {1}}}, false);
  const ImportedScene imported = Load(scene);
  EXPECT_EQ(imported.geometry.instances.at(0).object_to_world[3], 0.25);
}

TEST(Node, ZeroScaleAndUnnormalisedRotationsAreFine) {
  SceneBuilder scene;
  scene.AddTriangle();
  scene.AddTriangle();
  scene.json["nodes"][0]["scale"] = {0, 0, 0};
  scene.json["nodes"][1]["rotation"] = {0, 0, 2, 2};
  const ImportedScene imported = Load(scene);
  ExpectWorld(imported.geometry.instances.at(0).object_to_world,
              {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  ExpectWorld(imported.geometry.instances.at(1).object_to_world,
              {0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0});
}

TEST(Node, AMeshShownTwiceIsStoredOnce) {
  SceneBuilder scene;
  const int mesh = scene.AddQuad();
  scene.AddNode({{"mesh", mesh}, {"translation", {5, 0, 0}}});
  const ImportedScene imported = Load(scene);
  EXPECT_THAT(imported.geometry.meshes, SizeIs(1));
  ASSERT_THAT(imported.geometry.instances, SizeIs(2));
  EXPECT_EQ(imported.geometry.instances[0].object, 1);
  EXPECT_EQ(imported.geometry.instances[1].object, 2);
  EXPECT_EQ(imported.summary.triangles_stored, 2u);
  EXPECT_EQ(imported.summary.triangles_drawn, 4u);
}

TEST(Node, GpuInstancesAreInstances) {
  SceneBuilder scene;
  scene.AddTriangle();
  const int places = scene.AddAccessor<float>("VEC3", {1, 0, 0, 2, 0, 0});
  const int turns = scene.AddAccessor<int16_t>("VEC4", {0, 0, 0, 32767, 0, 0, 32767, 0}, true);
  const int scales = scene.AddAccessor<float>("VEC3", {1, 1, 1, 2, 2, 2});
  scene.json["nodes"][0]["translation"] = {0, 10, 0};
  scene.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", places}, {"ROTATION", turns}, {"SCALE", scales}};
  const ImportedScene imported = Load(scene);
  ASSERT_THAT(imported.geometry.instances, SizeIs(2));
  ExpectWorld(imported.geometry.instances[0].object_to_world,
              {1, 0, 0, 1, 0, 1, 0, 10, 0, 0, 1, 0});
  ExpectWorld(imported.geometry.instances[1].object_to_world,
              {-2, 0, 0, 2, 0, -2, 0, 10, 0, 0, 2, 0});
  EXPECT_THAT(imported.geometry.meshes, SizeIs(1));
}

TEST(Node, GpuInstanceAttributesMustAgree) {
  SceneBuilder scene;
  scene.AddTriangle();
  const int places = scene.AddAccessor<float>("VEC3", {1, 0, 0, 2, 0, 0});
  const int scales = scene.AddAccessor<float>("VEC3", {1, 1, 1});
  scene.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", places}, {"SCALE", scales}};
  EXPECT_THAT(ErrorOf(scene),
              HasSubstr("/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes/SCALE"));
}

/// Two scenes of one triangle each, the second named; the default is the one given.
SceneBuilder TwoScenes() {
  SceneBuilder scene;
  scene.AddTriangle();
  scene.AddNode({{"mesh", 0}, {"name", "second"}}, false);
  scene.json["scenes"].push_back({{"nodes", {1}}, {"name", "other"}});
  return scene;
}

int DrawnObject(const SceneBuilder& scene, const std::string& wanted) {
  LoadOptions options;
  options.scene = wanted;
  return Load(scene, options).geometry.instances.at(0).object;
}

TEST(Scene, IsChosenByNameOrIndexOrDefault) {
  SceneBuilder scene = TwoScenes();
  EXPECT_EQ(DrawnObject(scene, ""), 1);
  EXPECT_EQ(DrawnObject(scene, "other"), 2);
  EXPECT_EQ(DrawnObject(scene, "1"), 2);
  EXPECT_EQ(DrawnObject(scene, "0"), 1);
  scene.json["scene"] = 1;
  EXPECT_EQ(DrawnObject(scene, ""), 2);
  scene.json["scenes"][0]["name"] = "1";  // a name goes before an index
  EXPECT_EQ(DrawnObject(scene, "1"), 1);
}

TEST(Scene, UnknownOnesAreListed) {
  LoadOptions options;
  options.scene = "third";
  const std::string error = ErrorOf(TwoScenes(), options);
  EXPECT_THAT(error, HasSubstr("/scenes: there is no scene 'third'; choose one of: 0, 1 'other'"));
  for (const char* wanted : {"2", "-1", "1x", "99999999999"}) {
    options.scene = wanted;
    EXPECT_NE(ErrorOf(TwoScenes(), options), "") << wanted;
  }
}

TEST(Scene, WithoutScenesAllRootsAreDrawn) {
  SceneBuilder scene;
  scene.AddTriangle();
  scene.AddNode({{"mesh", 0}});
  scene.json.erase("scenes");
  scene.json.erase("scene");
  EXPECT_THAT(Load(scene).geometry.instances, SizeIs(2));
}

TEST(Scene, ARootListedTwiceIsDrawnOnce) {
  SceneBuilder scene;
  scene.AddTriangle();
  scene.json["scenes"][0]["nodes"] = {0, 0};
  EXPECT_THAT(Load(scene).geometry.instances, SizeIs(1));
}

TEST(Hierarchy, CyclesAreRefused) {
  SceneBuilder scene;
  scene.AddTriangle();
  scene.AddNode({{"children", {2}}});
  scene.AddNode({{"children", {1}}}, false);
  EXPECT_THAT(ErrorOf(scene), HasSubstr("/nodes/1: the node is its own ancestor"));

  SceneBuilder self;
  self.AddTriangle();
  self.json["nodes"][0]["children"] = {0};
  EXPECT_THAT(ErrorOf(self), HasSubstr("/nodes/0: the node is its own ancestor"));

  SceneBuilder apart;  // a circle that the scene does not reach
  apart.AddTriangle();
  apart.AddNode({{"children", {2}}}, false);
  apart.AddNode({{"children", {1}}}, false);
  EXPECT_THAT(ErrorOf(apart), HasSubstr("/nodes/1: the node is its own ancestor"));
}

TEST(Hierarchy, TwoParentsAreRefused) {
  SceneBuilder scene;
  scene.AddTriangle();
  scene.AddNode({{"children", {0}}});
  scene.AddNode({{"children", {0}}});
  EXPECT_THAT(ErrorOf(scene),
              HasSubstr("/nodes/2/children/0: node 0 already has a parent (node 1)"));
}

TEST(Hierarchy, DepthIsNoDanger) {
  constexpr int kDepth = 200000;
  SceneBuilder scene;
  scene.AddTriangle();
  Json nodes = Json::array();
  for (int n = 0; n < kDepth; ++n)
    nodes.push_back({{"children", {n + 1}}, {"translation", {1, 0, 0}}});
  nodes.push_back({{"mesh", 0}});
  scene.json["nodes"] = nodes;
  const ImportedScene imported = Load(scene);
  EXPECT_EQ(imported.geometry.instances.at(0).object_to_world[3], kDepth);
}

TEST(Hierarchy, TransformsThatOverflowAreRefused) {
  SceneBuilder scene;
  scene.AddTriangle();
  for (int n = 0; n < 12; ++n) scene.AddNode({{"children", {n}}, {"scale", {1e30, 1, 1}}}, false);
  scene.json["scenes"][0]["nodes"] = {12};
  EXPECT_THAT(ErrorOf(scene), HasSubstr("/nodes/0: the node's transform is not finite"));
}

TEST(Camera, PerspectiveAndOrthographic) {
  SceneBuilder scene;
  scene.json["cameras"] = {
      {{"type", "perspective"},
       {"name", "lens"},
       {"perspective", {{"yfov", 0.5}, {"aspectRatio", 2}, {"znear", 0.1}}}},
      {{"type", "orthographic"},
       {"orthographic", {{"xmag", 3}, {"ymag", 2}, {"znear", 0}, {"zfar", 9}}}}};
  scene.AddNode({{"camera", 0}, {"translation", {1, 2, 3}}});
  scene.AddNode({{"camera", 1}, {"name", "top"}});
  scene.AddNode({{"camera", 0}, {"name", "again"}});
  const ImportedScene imported = Load(scene);
  ASSERT_THAT(imported.cameras, SizeIs(3));
  const CameraNode& lens = imported.cameras[0];
  EXPECT_EQ(lens.name, "lens");
  EXPECT_FALSE(lens.orthographic);
  EXPECT_EQ(lens.yfov, 0.5);
  EXPECT_EQ(lens.aspect, 2);
  EXPECT_EQ(lens.zfar, 0);
  ExpectWorld(lens.world, {1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3});
  const CameraNode& top = imported.cameras[1];
  EXPECT_EQ(top.name, "top");
  EXPECT_TRUE(top.orthographic);
  EXPECT_EQ(top.xmag, 3);
  EXPECT_EQ(top.ymag, 2);
  EXPECT_EQ(top.zfar, 9);
  EXPECT_EQ(imported.cameras[2].name, "again");
  EXPECT_EQ(imported.cameras[2].camera_name, "lens");
}

TEST(Camera, BrokenOnesAreRefused) {
  SceneBuilder scene;
  scene.AddNode({{"camera", 0}});
  scene.json["cameras"] = {{{"type", "perspective"}}};
  EXPECT_THAT(ErrorOf(scene), HasSubstr("/cameras/0: the object 'perspective' is missing"));
  scene.json["cameras"] = {{{"type", "fisheye"}}};
  EXPECT_THAT(ErrorOf(scene),
              HasSubstr("/cameras/0/type: must be one of 'perspective' 'orthographic'"));
  scene.json["cameras"] = {
      {{"type", "perspective"}, {"perspective", {{"yfov", -1}, {"znear", 1}}}}};
  EXPECT_THAT(ErrorOf(scene), HasSubstr("/cameras/0/perspective/yfov: is -1"));
  scene.json["cameras"] = {
      {{"type", "orthographic"},
       {"orthographic", {{"xmag", 0}, {"ymag", 1}, {"znear", 0}, {"zfar", 1}}}}};
  EXPECT_THAT(ErrorOf(scene), HasSubstr("/cameras/0/orthographic: xmag and ymag must not be 0"));
}

SceneBuilder WithLight(const Json& light) {
  SceneBuilder scene;
  scene.json["extensionsUsed"] = {"KHR_lights_punctual"};
  scene.json["extensions"]["KHR_lights_punctual"]["lights"] = Json::array({light});
  scene.AddNode(
      {{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}, {"translation", {0, 7, 0}}});
  return scene;
}

TEST(Light, ReadsAllThreeTypes) {
  const PunctualLight point =
      Load(WithLight({{"type", "point"}, {"intensity", 40}, {"range", 3}, {"color", {1, 0.5, 0}}}))
          .lights.at(0);
  EXPECT_EQ(point.type, PunctualType::point);
  EXPECT_EQ(point.intensity, 40);
  EXPECT_EQ(point.range, 3);
  EXPECT_THAT(point.color, ElementsAre(1, 0.5, 0));
  EXPECT_EQ(point.world[7], 7);

  const PunctualLight spot =
      Load(WithLight(
               {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.1}, {"outerConeAngle", 0.2}}}}))
          .lights.at(0);
  EXPECT_EQ(spot.type, PunctualType::spot);
  EXPECT_EQ(spot.intensity, 1);
  EXPECT_EQ(spot.range, 0);
  EXPECT_EQ(spot.inner_cone, 0.1);
  EXPECT_EQ(spot.outer_cone, 0.2);

  const PunctualLight plain = Load(WithLight({{"type", "spot"}})).lights.at(0);
  EXPECT_EQ(plain.inner_cone, 0);
  EXPECT_NEAR(plain.outer_cone, std::acos(-1) / 4, 1e-15);

  const PunctualLight sun =
      Load(WithLight({{"type", "directional"}, {"intensity", 100000}, {"range", 3}})).lights.at(0);
  EXPECT_EQ(sun.type, PunctualType::directional);
  EXPECT_EQ(sun.range, 0);
}

TEST(Light, ConesOutOfOrderAreClampedWithAWarning) {
  std::vector<std::string> warnings;
  const SceneBuilder scene =
      WithLight({{"type", "spot"}, {"spot", {{"innerConeAngle", 0.5}, {"outerConeAngle", 0.2}}}});
  EXPECT_EQ(Load(scene, Collect(warnings)).lights.at(0).inner_cone, 0.2);
  ASSERT_THAT(warnings, SizeIs(1));
  EXPECT_THAT(warnings[0], HasSubstr("/extensions/KHR_lights_punctual/lights/0/spot"));
}

TEST(Light, BrokenOnesAreRefused) {
  SceneBuilder scene = WithLight({{"type", "point"}});
  scene.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 1;
  EXPECT_THAT(ErrorOf(scene),
              HasSubstr("/nodes/0/extensions/KHR_lights_punctual/light: refers to light 1"));
  EXPECT_THAT(ErrorOf(WithLight({{"type", "area"}})),
              HasSubstr("/extensions/KHR_lights_punctual/lights/0/type"));
  EXPECT_THAT(ErrorOf(WithLight({{"type", "point"}, {"intensity", -1}})),
              HasSubstr("/intensity: is -1"));
  EXPECT_THAT(ErrorOf(WithLight("point")),
              HasSubstr("/extensions/KHR_lights_punctual/lights/0: must be an object"));
}

}  // namespace
}  // namespace carpool::render
