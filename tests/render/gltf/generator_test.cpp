// The scenes that the generator makes: they load in silence and hold what their names say.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "scenes/png_writer.h"
#include "scenes/scenes.h"
#include "tests/render/gltf/scene_builder.h"

namespace carpool::render {
namespace {

using ::testing::FloatNear;
using ::testing::IsEmpty;
using ::testing::Pointwise;

/// Writes a generated scene and loads it; any warning is a failure.
ImportedScene Generated(const scenes::GltfWriter& writer, const std::string& name) {
  const TemporaryFolder folder;
  writer.Write(folder / name);
  std::vector<std::string> warnings;
  ImportedScene scene = LoadGltf(folder / name, Collect(warnings));
  EXPECT_THAT(warnings, IsEmpty());
  EXPECT_EQ(scene.cameras.size(), 1u);
  return scene;
}

TEST(Generator, InstancesAreInstances) {
  const ImportedScene scene = Generated(scenes::Instances(500), "scene.glb");
  EXPECT_EQ(scene.geometry.instances.size(), 502u);  // with plain and sky
  EXPECT_EQ(scene.summary.triangles_drawn, 500u * 7200 + 4);
  EXPECT_LT(scene.geometry.indices.size(), 3u * 7300);  // all materials share one ball
}

TEST(Generator, LightsAreAllThere) {
  const ImportedScene scene = Generated(scenes::Lights(1000), "scene.glb");
  uint64_t emissive = 0;
  for (const stages::Shape& shape : scene.geometry.shapes) {
    const bool emits = (scene.materials[shape.material].flags & stages::kMaterialEmissive) != 0;
    emissive += emits ? shape.triangle_count : 0;
  }
  EXPECT_EQ(emissive, 1000u);
}

TEST(Generator, EveryTexturedMaterialHasItsOwnPicture) {
  const ImportedScene scene = Generated(scenes::Textures(9), "scene.gltf");
  EXPECT_EQ(scene.texture_sources.size(), 9u);
  std::set<std::string> pictures;
  for (const EncodedImage& image : scene.images) {
    pictures.emplace(reinterpret_cast<const char*>(image.bytes.data()), image.bytes.size());
  }
  EXPECT_EQ(pictures.size(), 9u);
}

/// Sines may differ in their last bit between machines.
void ExpectSameVertices(const ImportedScene& made, const ImportedScene& kept,
                        const std::string& name) {
  ASSERT_EQ(made.geometry.shapes.size(), kept.geometry.shapes.size()) << name;
  const auto near = [](const auto& values) { return Pointwise(FloatNear(1e-6f), values); };
  for (int s = 0; s < static_cast<int>(made.geometry.shapes.size()); ++s) {
    EXPECT_THAT(Positions(made, s), near(Positions(kept, s))) << name;
    EXPECT_THAT(Normals(made, s), near(Normals(kept, s))) << name;
    EXPECT_THAT(FirstUvs(made, s), near(FirstUvs(kept, s))) << name;
  }
  EXPECT_THAT(made.geometry.floats, near(kept.geometry.floats)) << name;
}

TEST(Generator, StoredScenesAreWhatItWrites) {
  const std::pair<const char*, scenes::GltfWriter> stored[] = {
      {"cornell_box.gltf", scenes::CornellBox()},
      {"furnace.gltf", scenes::Furnace()},
      {"materials.gltf", scenes::Materials()}};
  for (const auto& [name, writer] : stored) {
    const ImportedScene made = Generated(writer, name);
    const ImportedScene kept = LoadGltf(std::filesystem::path(CARPOOL_SCENES) / name);
    EXPECT_EQ(made.node_names, kept.node_names) << name << ": run generate-scenes small scenes";
    EXPECT_EQ(made.geometry.indices, kept.geometry.indices) << name;
    ExpectSameVertices(made, kept, name);
    ASSERT_EQ(made.materials.size(), kept.materials.size()) << name;
    for (size_t m = 0; m < made.materials.size(); ++m) {
      EXPECT_THAT(made.materials[m].base_color,
                  Pointwise(FloatNear(1e-6f), kept.materials[m].base_color));
      EXPECT_THAT(made.materials[m].emissive,
                  Pointwise(FloatNear(1e-5f), kept.materials[m].emissive));
      EXPECT_FLOAT_EQ(made.materials[m].roughness, kept.materials[m].roughness);
    }
    for (size_t i = 0; i < 12; ++i)
      EXPECT_NEAR(made.cameras[0].world[i], kept.cameras[0].world[i], 1e-9);
  }
}

TEST(Png, ChecksumsAreThoseOfTheFormat) {
  // A grey pixel; the stored block's Adler-32 and the chunks' CRC-32 worked out with zlib.
  const std::string png = scenes::EncodePng(1, 1, {1, 2, 3});
  const std::string idat("\x78\x01\x01\x04\x00\xfb\xff\x00\x01\x02\x03\x00\x0e\x00\x07", 15);
  EXPECT_NE(png.find("IDAT" + idat), std::string::npos);
  EXPECT_EQ(png.substr(png.size() - 4), std::string("\xae\x42\x60\x82", 4));
}

}  // namespace
}  // namespace carpool::render
