// Primitives: topologies, normals and their defaults, UV sets, sharing of streams.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/render/gltf/scene_builder.h"

namespace carpool::render {
namespace {

using stages::kNone;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

/// Five vertices in a drawing mode, indexed or not.
SceneBuilder FiveVertices(int mode, bool indexed) {
  SceneBuilder scene;
  const int positions =
      scene.AddAccessor<float>("VEC3", {0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, 2, 0, 0});
  Json primitive = {{"attributes", {{"POSITION", positions}}}, {"mode", mode}};
  if (indexed) primitive["indices"] = scene.AddAccessor<uint16_t>("SCALAR", {4, 3, 2, 1, 0});
  scene.AddMesh(primitive);
  return scene;
}

TEST(Primitive, StripsKeepTheirWinding) {
  EXPECT_THAT(Load(FiveVertices(5, false)).geometry.indices,
              ElementsAre(0, 1, 2, 1, 3, 2, 2, 3, 4));
  EXPECT_THAT(Load(FiveVertices(5, true)).geometry.indices, ElementsAre(4, 3, 2, 3, 1, 2, 2, 1, 0));
}

TEST(Primitive, FansTurnAroundTheirFirstVertex) {
  EXPECT_THAT(Load(FiveVertices(6, false)).geometry.indices,
              ElementsAre(1, 2, 0, 2, 3, 0, 3, 4, 0));
  EXPECT_THAT(Load(FiveVertices(6, true)).geometry.indices, ElementsAre(3, 2, 4, 2, 1, 4, 1, 0, 4));
}

TEST(Primitive, AnIncompleteTriangleIsLeftOutWithAWarning) {
  std::vector<std::string> warnings;
  const ImportedScene imported = Load(FiveVertices(4, false), Collect(warnings));
  EXPECT_THAT(imported.geometry.indices, ElementsAre(0, 1, 2));
  EXPECT_EQ(imported.geometry.shapes[0].vertex_count, 3);
  ASSERT_THAT(warnings, SizeIs(1));
  EXPECT_THAT(warnings[0], HasSubstr("incomplete"));
}

TEST(Primitive, PointsAndLinesAreSkippedWithOneWarning) {
  SceneBuilder scene = FiveVertices(4, false);
  for (int mode : {0, 1, 2, 3}) {
    Json primitive = scene.json["meshes"][0]["primitives"][0];
    primitive["mode"] = mode;
    scene.AddMesh(primitive);
  }
  std::vector<std::string> warnings;
  const ImportedScene imported = Load(scene, Collect(warnings));
  EXPECT_THAT(imported.geometry.instances, SizeIs(1));
  EXPECT_EQ(std::count_if(warnings.begin(), warnings.end(),
                          [](const std::string& w) {
                            return w.find("points and lines") != std::string::npos;
                          }),
            1);
}

TEST(Primitive, MissingNormalsStayFlat) {
  SceneBuilder scene;
  scene.AddTriangle();
  const ImportedScene imported = Load(scene);
  const stages::Shape& shape = imported.geometry.shapes.at(0);
  EXPECT_FALSE(shape.smooth);
  EXPECT_EQ(shape.tangents, kNone);
  EXPECT_EQ(shape.uv_sets, 0);
  EXPECT_EQ(shape.more_uvs, kNone);
  EXPECT_EQ(shape.colors, kNone);
  EXPECT_EQ(shape.triangle_count, 1);
  EXPECT_EQ(shape.vertex_count, 3);
}

TEST(Primitive, NormalsAreMadeUnitLength) {
  SceneBuilder scene;
  scene.AddTriangle();
  scene.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] =
      scene.AddAccessor<float>("VEC3", {0, 0, 3, 0, 1e-30f, 0, 1e30f, 0, 0});
  const ImportedScene imported = Load(scene);
  EXPECT_THAT(Normals(imported), ElementsAre(0, 0, 1, 0, 1, 0, 1, 0, 0));
}

TEST(Primitive, NormalsWithoutDirectionAreThoseOfTheFaces) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  SceneBuilder scene;
  scene.AddTriangle();
  scene.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] =
      scene.AddAccessor<float>("VEC3", {0, 0, 0, nan, 0, 1, 1, 0, 0});
  std::vector<std::string> warnings;
  const ImportedScene imported = Load(scene, Collect(warnings));
  EXPECT_THAT(Normals(imported), ElementsAre(0, 0, 1, 0, 0, 1, 1, 0, 0));
  EXPECT_THAT(warnings, SizeIs(1));
}

TEST(Primitive, AZeroNormalOfATriangleWithoutAreaIsUp) {
  SceneBuilder scene;
  const int positions = scene.AddAccessor<float>("VEC3", {1, 1, 1, 1, 1, 1, 1, 1, 1});
  const int normals = scene.AddAccessor<float>("VEC3", std::vector<float>(9, 0.0f));
  scene.AddMesh({{"attributes", {{"POSITION", positions}, {"NORMAL", normals}}}});
  const ImportedScene imported = Load(scene);
  EXPECT_THAT(Normals(imported), ElementsAre(0, 0, 1, 0, 0, 1, 0, 0, 1));
}

/// A quad with TEXCOORD_0 and _2, whose material reads the sets given.
SceneBuilder QuadWithSets(const std::vector<int>& sets) {
  SceneBuilder scene;
  scene.AddQuad();
  Json& primitive = scene.json["meshes"][0]["primitives"][0];
  primitive["attributes"]["TEXCOORD_2"] =
      scene.AddAccessor<float>("VEC2", {10, 11, 12, 13, 14, 15, 16, 17});
  primitive["material"] = 0;
  scene.json["images"] = {{{"bufferView", scene.AddView(TinyPng())}, {"mimeType", "image/png"}}};
  scene.json["textures"] = {{{"source", 0}}};
  const char* slots[] = {"baseColorTexture", "metallicRoughnessTexture"};
  Json pbr;
  for (size_t i = 0; i < sets.size(); ++i) pbr[slots[i]] = {{"index", 0}, {"texCoord", sets[i]}};
  scene.json["materials"] = {{{"pbrMetallicRoughness", pbr}}};
  return scene;
}

TEST(Primitive, KeepsOnlyTheUvSetsThatItsMaterialReads) {
  const ImportedScene one = Load(QuadWithSets({2}));
  EXPECT_EQ(one.geometry.shapes[0].uv_sets, 1);
  EXPECT_EQ(one.slots.at(0).uv_set, 0);
  EXPECT_THAT(FirstUvs(one), ElementsAre(10, 11, 12, 13, 14, 15, 16, 17));

  const ImportedScene two = Load(QuadWithSets({2, 0}));
  EXPECT_EQ(two.geometry.shapes[0].uv_sets, 2);
  EXPECT_EQ(two.slots.at(0).uv_set, 0);
  EXPECT_EQ(two.slots.at(1).uv_set, 1);
  EXPECT_THAT(FirstUvs(two), ElementsAre(10, 11, 12, 13, 14, 15, 16, 17));
  EXPECT_THAT(Stream(two, 0, two.geometry.shapes[0].more_uvs, 2),
              ElementsAre(0, 1, 1, 1, 1, 0, 0, 0));
}

TEST(Primitive, AMissingUvSetIsZeroWithAWarning) {
  std::vector<std::string> warnings;
  const ImportedScene imported = Load(QuadWithSets({5}), Collect(warnings));
  EXPECT_THAT(FirstUvs(imported), ElementsAre(0, 0, 0, 0, 0, 0, 0, 0));
  ASSERT_THAT(warnings, SizeIs(1));
  EXPECT_THAT(warnings[0], HasSubstr("TEXCOORD_5"));
}

TEST(Primitive, PrimitivesOverTheSameAccessorsShareTheirStreams) {
  SceneBuilder scene;
  scene.AddQuad();
  scene.json["materials"] = {{{"doubleSided", true}}, {{"doubleSided", false}}};
  Json& primitives = scene.json["meshes"][0]["primitives"];
  for (int material : {0, 1}) {
    Json copy = primitives[0];
    copy["material"] = material;
    primitives.push_back(copy);
  }
  const ImportedScene imported = Load(scene);
  ASSERT_THAT(imported.geometry.shapes, SizeIs(3));
  EXPECT_THAT(imported.geometry.indices, SizeIs(6));
  EXPECT_EQ(imported.geometry.shapes[0].material, 2);  // the default one, after the file's two
  EXPECT_EQ(imported.geometry.shapes[1].material, 0);
  EXPECT_EQ(imported.geometry.shapes[2].material, 1);
  EXPECT_EQ(imported.geometry.shapes[1].first_vertex, imported.geometry.shapes[2].first_vertex);
  EXPECT_THAT(imported.materials, SizeIs(3));
}

TEST(Primitive, WithoutPositionIsLeftOut) {
  SceneBuilder scene;
  scene.AddQuad();
  scene.json["meshes"][0]["primitives"][0]["attributes"].erase("POSITION");
  std::vector<std::string> warnings;
  EXPECT_TRUE(Load(scene, Collect(warnings)).geometry.instances.empty());
  ASSERT_THAT(warnings, SizeIs(1));
  EXPECT_THAT(warnings[0], HasSubstr("POSITION"));
}

}  // namespace
}  // namespace carpool::render
