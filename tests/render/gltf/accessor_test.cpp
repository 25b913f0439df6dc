// Accessors: every component type, normalised, strided, sparse and without data.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/render/gltf/scene_builder.h"

namespace carpool::render {
namespace {

using ::testing::ElementsAre;
using ::testing::FloatEq;
using ::testing::FloatNear;
using ::testing::HasSubstr;
using ::testing::Pointwise;

/// A triangle whose COLOR_0 is the given accessor.
template <typename T>
std::vector<float> LoadColors(const std::vector<T>& values, const std::string& type) {
  SceneBuilder scene;
  scene.AddTriangle();
  const bool normalized = !std::is_same_v<T, float>;
  scene.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
      scene.AddAccessor<T>(type, values, normalized);
  const ImportedScene imported = Load(scene);
  return Stream(imported, 0, imported.geometry.shapes[0].colors, 4);
}

/// A triangle whose positions are the given accessor, with KHR_mesh_quantization.
template <typename T>
std::vector<float> LoadPositions(const std::vector<T>& values, bool normalized) {
  SceneBuilder scene;
  scene.json["extensionsUsed"] = scene.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  const int positions = scene.AddAccessor<T>("VEC3", values, normalized);
  scene.AddMesh({{"attributes", {{"POSITION", positions}}}});
  return Positions(Load(scene));
}

TEST(Accessor, ReadsColorsOfEveryType) {
  const std::vector<float> expected = {1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1};
  EXPECT_EQ(LoadColors<float>({1, 0, 0, 0, 1, 0, 0, 0, 1}, "VEC3"), expected);
  EXPECT_EQ(LoadColors<uint8_t>({255, 0, 0, 0, 255, 0, 0, 0, 255}, "VEC3"), expected);
  EXPECT_EQ(LoadColors<uint16_t>({65535, 0, 0, 0, 65535, 0, 0, 0, 65535}, "VEC3"), expected);
  const std::vector<float> with_alpha =
      LoadColors<uint8_t>({51, 102, 153, 204, 0, 0, 0, 0, 255, 255, 255, 255}, "VEC4");
  EXPECT_THAT(with_alpha, Pointwise(FloatEq(), std::vector<float>{0.2f, 0.4f, 0.6f, 0.8f, 0, 0, 0,
                                                                  0, 1, 1, 1, 1}));
}

TEST(Accessor, ClampsFloatColors) {
  EXPECT_THAT(LoadColors<float>({2, -1, 0.5f, 0, 0, 0, 0, 0, 0}, "VEC3"),
              ElementsAre(1, 0, 0.5f, 1, 0, 0, 0, 1, 0, 0, 0, 1));
}

TEST(Accessor, ReadsQuantizedPositions) {
  const std::vector<float> plain = {0, 0, 0, 100, -7, 0, 0, 100, 3};
  EXPECT_EQ(LoadPositions<int8_t>({0, 0, 0, 100, -7, 0, 0, 100, 3}, false), plain);
  EXPECT_EQ(LoadPositions<int16_t>({0, 0, 0, 100, -7, 0, 0, 100, 3}, false), plain);
  EXPECT_EQ(LoadPositions<uint16_t>({0, 0, 0, 40000, 7, 0, 0, 9, 3}, false),
            (std::vector<float>{0, 0, 0, 40000, 7, 0, 0, 9, 3}));
  // c / 127, and both -128 and -127 are -1.
  EXPECT_THAT(LoadPositions<int8_t>({0, 0, 0, 127, -128, -127, 0, 64, 0}, true),
              Pointwise(FloatEq(), std::vector<float>{0, 0, 0, 1, -1, -1, 0, 64 / 127.0f, 0}));
  EXPECT_THAT(LoadPositions<int16_t>({0, 0, 0, 32767, -32768, -32767, 0, 1, 0}, true),
              Pointwise(FloatEq(), std::vector<float>{0, 0, 0, 1, -1, -1, 0, 1 / 32767.0f, 0}));
  EXPECT_THAT(LoadPositions<uint8_t>({0, 0, 0, 255, 51, 0, 0, 102, 0}, true),
              Pointwise(FloatEq(), std::vector<float>{0, 0, 0, 1, 0.2f, 0, 0, 0.4f, 0}));
}

TEST(Accessor, ReadsIndicesOfEveryType) {
  for (int type : {0, 1, 2}) {
    SceneBuilder scene;
    scene.AddQuad();
    int indices = 0;
    if (type == 0) indices = scene.AddAccessor<uint8_t>("SCALAR", {0, 1, 2, 0, 2, 3});
    if (type == 1) indices = scene.AddAccessor<uint16_t>("SCALAR", {0, 1, 2, 0, 2, 3});
    if (type == 2) indices = scene.AddAccessor<uint32_t>("SCALAR", {0, 1, 2, 0, 2, 3});
    scene.json["meshes"][0]["primitives"][0]["indices"] = indices;
    EXPECT_THAT(Load(scene).geometry.indices, ElementsAre(0, 1, 2, 0, 2, 3)) << type;
  }
}

TEST(Accessor, ReadsInterleavedViews) {
  // Position and normal alternate: stride 24, the normals 12 bytes in.
  const std::vector<float> mixed = {0, 0, 0, 0, 0, 2, 1, 0, 0, 0, 0, 3, 0, 1, 0, 0, 0, 4};
  SceneBuilder scene;
  const int view = scene.AddView({reinterpret_cast<const char*>(mixed.data()), mixed.size() * 4});
  scene.json["bufferViews"][view]["byteStride"] = 24;
  for (int offset : {0, 12}) {
    scene.json["accessors"].push_back({{"bufferView", view},
                                       {"byteOffset", offset},
                                       {"componentType", 5126},
                                       {"count", 3},
                                       {"type", "VEC3"}});
  }
  scene.AddMesh({{"attributes", {{"POSITION", 0}, {"NORMAL", 1}}}});
  const ImportedScene imported = Load(scene);
  EXPECT_THAT(Positions(imported), ElementsAre(0, 0, 0, 1, 0, 0, 0, 1, 0));
  EXPECT_THAT(Normals(imported), ElementsAre(0, 0, 1, 0, 0, 1, 0, 0, 1));
}

Json SparsePart(SceneBuilder& scene, const std::vector<uint16_t>& indices,
                const std::vector<float>& values) {
  const int at = scene.AddView({reinterpret_cast<const char*>(indices.data()), indices.size() * 2});
  const int with = scene.AddView({reinterpret_cast<const char*>(values.data()), values.size() * 4});
  return {{"count", indices.size()},
          {"indices", {{"bufferView", at}, {"componentType", 5123}}},
          {"values", {{"bufferView", with}}}};
}

TEST(Accessor, AppliesSparseValues) {
  SceneBuilder scene;
  scene.AddTriangle();
  scene.json["accessors"][0]["sparse"] = SparsePart(scene, {0, 2}, {9, 8, 7, 6, 5, 4});
  EXPECT_THAT(Positions(Load(scene)), ElementsAre(9, 8, 7, 1, 0, 0, 6, 5, 4));
}

TEST(Accessor, WithoutViewIsZeroUnderSparseValues) {
  SceneBuilder scene;
  scene.AddTriangle();
  scene.json["accessors"][0].erase("bufferView");
  scene.json["accessors"][0]["sparse"] = SparsePart(scene, {1, 2}, {1, 0, 0, 0, 1, 0});
  EXPECT_THAT(Positions(Load(scene)), ElementsAre(0, 0, 0, 1, 0, 0, 0, 1, 0));
}

TEST(Accessor, SparseIndicesOfAnIndexAccessorWithoutView) {
  SceneBuilder scene;
  scene.AddQuad();
  Json& accessor = scene.json["accessors"][3];
  accessor.erase("bufferView");
  const std::vector<uint8_t> at = {1, 2, 4, 5};
  const std::vector<uint16_t> with = {1, 2, 2, 3};
  const int at_view = scene.AddView({reinterpret_cast<const char*>(at.data()), 4});
  const int with_view = scene.AddView({reinterpret_cast<const char*>(with.data()), 8});
  accessor["sparse"] = {{"count", 4},
                        {"indices", {{"bufferView", at_view}, {"componentType", 5121}}},
                        {"values", {{"bufferView", with_view}}}};
  EXPECT_THAT(Load(scene).geometry.indices, ElementsAre(0, 1, 2, 0, 2, 3));
}

TEST(Accessor, KeepsOnlyVerticesThatTrianglesUse) {
  std::vector<float> positions(3000, 5.0f);
  for (int k = 0; k < 3; ++k) positions[3 * (300 * k + 7)] = static_cast<float>(k);
  SceneBuilder scene;
  const int position = scene.AddAccessor<float>("VEC3", positions);
  const int indices = scene.AddAccessor<uint16_t>("SCALAR", {607, 7, 307});
  scene.AddMesh({{"attributes", {{"POSITION", position}}}, {"indices", indices}});
  const ImportedScene imported = Load(scene);
  EXPECT_THAT(imported.geometry.indices, ElementsAre(2, 0, 1));
  EXPECT_THAT(Positions(imported), ElementsAre(0, 5, 5, 1, 5, 5, 2, 5, 5));
}

}  // namespace
}  // namespace carpool::render
