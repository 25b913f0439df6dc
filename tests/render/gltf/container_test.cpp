// The outer layer: GLB chunks, JSON text, versions, and what is wrong with broken ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/render/gltf/scene_builder.h"

namespace carpool::render {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::SizeIs;

/// A small valid GLB as bytes.
std::string GoodGlb() {
  SceneBuilder scene;
  scene.AddQuad();
  return scene.Glb();
}

std::string ErrorOfBytes(std::string_view bytes, const std::string& name = "scene.glb") {
  const TemporaryFolder folder;
  WriteText(folder / name, bytes);
  return ErrorOf(folder / name);
}

TEST(Container, BothFormatsGiveTheSameScene) {
  SceneBuilder scene;
  scene.AddQuad();
  const TemporaryFolder folder;
  const ImportedScene glb = LoadGltf(scene.WriteGlb(folder / "a.glb"));
  const ImportedScene gltf = LoadGltf(scene.WriteGltf(folder / "a.gltf"));
  EXPECT_EQ(Positions(glb), Positions(gltf));
  EXPECT_EQ(glb.geometry.indices, gltf.geometry.indices);
  EXPECT_THAT(gltf.geometry.instances, SizeIs(1));
}

TEST(Container, FormatIsToldByContentNotByName) {
  const TemporaryFolder folder;
  WriteText(folder / "misnamed.gltf", GoodGlb());
  EXPECT_EQ(ErrorOf(folder / "misnamed.gltf"), "");
}

TEST(Container, AcceptsAByteOrderMarkAndBytesAfterTheScene) {
  SceneBuilder scene;
  scene.AddQuad();
  EXPECT_EQ(ErrorOfBytes("\xEF\xBB\xBF" + scene.Gltf(), "scene.gltf"), "");
  EXPECT_EQ(ErrorOfBytes(GoodGlb() + "more"), "");
}

TEST(Container, MissingFile) {
  const TemporaryFolder folder;
  const std::string error = ErrorOf(folder / "none.glb");
  EXPECT_THAT(error, HasSubstr("none.glb: file '"));
  EXPECT_THAT(error, HasSubstr("does not exist; check the name"));
}

TEST(Container, AFolderIsNoFile) {
  const TemporaryFolder folder;
  EXPECT_THAT(ErrorOf(folder.path()), HasSubstr("not a regular file"));
}

TEST(Container, EmptyAndForeignFiles) {
  EXPECT_THAT(ErrorOfBytes(""), HasSubstr("the file is empty"));
  EXPECT_THAT(ErrorOfBytes("PK\x03\x04 something"), HasSubstr("not a glTF file"));
  EXPECT_THAT(ErrorOfBytes("   \n"), HasSubstr("not a glTF file"));
  EXPECT_THAT(ErrorOfBytes("[1, 2]", "a.gltf"), HasSubstr("not a glTF file"));
}

TEST(Container, EveryTruncationOfAGlbIsRefused) {
  const std::string good = GoodGlb();
  const TemporaryFolder folder;
  for (size_t length = 0; length < good.size(); ++length) {
    WriteText(folder / "cut.glb", std::string_view(good).substr(0, length));
    EXPECT_NE(ErrorOf(folder / "cut.glb"), "") << length;
  }
}

TEST(Container, WrongVersionAndChunkTypes) {
  std::string bytes = GoodGlb();
  bytes[4] = 1;
  EXPECT_THAT(ErrorOfBytes(bytes), HasSubstr("GLB version 1 is not supported"));
  bytes = GoodGlb();
  bytes[16] = 'X';
  EXPECT_THAT(ErrorOfBytes(bytes), HasSubstr("first GLB chunk is not JSON"));
  bytes = GoodGlb();
  bytes[14] = '\x7f';  // a JSON chunk of 8 million bytes
  EXPECT_THAT(ErrorOfBytes(bytes), HasSubstr("truncated"));
}

TEST(Container, InvalidJsonIsOneLine) {
  const std::string error = ErrorOfBytes("{\"asset\": {\"version\": \"2.0\"\n\n,,}", "a.gltf");
  EXPECT_THAT(error, HasSubstr("a.gltf: invalid JSON: "));
  EXPECT_EQ(error.find('\n'), std::string::npos);
  EXPECT_NE(ErrorOfBytes("{\"asset\": \"\xff\xfe\"}", "a.gltf"), "");
  EXPECT_NE(ErrorOfBytes("{\"asset\": {\"version\": \"2.0\"}, \"scene\": 1e999}", "a.gltf"), "");
}

TEST(Container, DeepNestingIsRefusedBeforeParsing) {
  std::string deep = R"({"asset": {"version": "2.0"}, "extras": )";
  deep += std::string(2000000, '[');
  EXPECT_THAT(ErrorOfBytes(deep, "a.gltf"), HasSubstr("nested deeper than 128"));
  // Brackets inside strings nest nothing.
  const std::string flat =
      R"({"asset": {"version": "2.0", "generator": "\")" + std::string(500, '[') + "\"}}";
  EXPECT_EQ(ErrorOfBytes(flat, "a.gltf"), "");
}

TEST(Container, Versions) {
  EXPECT_THAT(ErrorOfBytes("{}", "a.gltf"),
              EndsWith("/asset: this property is missing; correct the file or export it again"));
  EXPECT_THAT(ErrorOfBytes(R"({"asset": {"version": "1.0"}})", "a.gltf"),
              HasSubstr("/asset/version: glTF version '1.0'"));
  EXPECT_THAT(ErrorOfBytes(R"({"asset": {"version": "2.1", "minVersion": "2.1"}})", "a.gltf"),
              HasSubstr("/asset/minVersion"));
  EXPECT_EQ(ErrorOfBytes(R"({"asset": {"version": "2.1"}})", "a.gltf"), "");
}

TEST(Container, AnEmptySceneIsFine) {
  const ImportedScene scene = Load(SceneBuilder());
  EXPECT_TRUE(scene.geometry.instances.empty());
  EXPECT_TRUE(scene.materials.empty());
}

}  // namespace
}  // namespace carpool::render
