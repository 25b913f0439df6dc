// `carpool info`: the summary's counts, as text and as JSON.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/render/gltf/scene_builder.h"

namespace carpool::render {
namespace {

using ::testing::HasSubstr;

SceneBuilder Everything() {
  SceneBuilder scene;
  const int mesh = scene.AddQuad();
  scene.AddNode({{"mesh", mesh}, {"name", "second"}});
  scene.json["asset"]["generator"] = "by\nhand";
  scene.json["extensionsUsed"] = {"KHR_lights_punctual", "ACME_fancy"};
  scene.json["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "point"}, {"intensity", 12}}};
  scene.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 1}}}}};
  scene.AddNode(
      {{"camera", 0}, {"name", "eye"}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  scene.json["materials"] = {{{"emissiveFactor", {1, 1, 1}}, {"emissiveTexture", {{"index", 0}}}},
                             Json::object()};
  scene.json["textures"] = {{{"source", 0}}};
  scene.json["images"] = {{{"bufferView", scene.AddView(TinyPng())}}};
  scene.json["animations"] = Json::array({Json::object()});
  return scene;
}

TEST(Info, Counts) {
  const SceneSummary summary = Load(Everything()).summary;
  EXPECT_EQ(summary.nodes, 3u);
  EXPECT_EQ(summary.meshes, 1u);
  EXPECT_EQ(summary.primitives, 1u);
  EXPECT_EQ(summary.triangles_stored, 2u);
  EXPECT_EQ(summary.triangles_drawn, 4u);
  EXPECT_EQ(summary.materials, 2u);
  EXPECT_EQ(summary.lights, 1u);
  EXPECT_EQ(summary.cameras, 1u);
  EXPECT_EQ(summary.animations, 1u);
  EXPECT_EQ(summary.scene, 0);
  EXPECT_EQ(summary.file_bytes, Everything().Glb().size());
  ASSERT_EQ(summary.extensions.size(), 2u);
  EXPECT_TRUE(summary.extensions[0].supported);
  EXPECT_FALSE(summary.extensions[1].supported);
}

TEST(Info, TextHasOneFactPerLine) {
  const std::string text = DescribeScene(Load(Everything()));
  EXPECT_THAT(text, HasSubstr("triangles      2 stored, 4 drawn by 2 instances\n"));
  EXPECT_THAT(text, HasSubstr("camera         eye: perspective, 57.3 degrees high\n"));
  EXPECT_THAT(text, HasSubstr("light          eye: point, 12 candela\n"));
  EXPECT_THAT(text, HasSubstr("extension      ACME_fancy (optional, not supported)\n"));
  EXPECT_THAT(text, HasSubstr("generator      by?hand\n"));
}

TEST(Info, JsonParsesAndAgrees) {
  const Json json = Json::parse(DescribeSceneJson(Load(Everything())));
  EXPECT_EQ(json["triangles_drawn"], 4);
  EXPECT_EQ(json["emissive_materials"], 1);
  EXPECT_EQ(json["cameras"][0]["name"], "eye");
  EXPECT_EQ(json["lights"][0]["type"], "point");
  EXPECT_EQ(json["extensions"][1]["supported"], false);
}

TEST(Info, AnimationsAreWarnedAbout) {
  std::vector<std::string> warnings;
  Load(Everything(), Collect(warnings));
  EXPECT_THAT(warnings, testing::Contains(HasSubstr("/animations: animations are not played")));
}

}  // namespace
}  // namespace carpool::render
