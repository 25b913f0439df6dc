// Real files: every model of the development set, its triangles counted, and this project's own
// scenes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "render/gltf/affine.h"
#include "render/gltf/materials.h"
#include "render/gltf/normals.h"
#include "render/gltf/tangents.h"
#include "tests/render/gltf/scene_builder.h"

namespace carpool::render {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

struct Model {
  const char* file;
  uint64_t stored;  // triangles, from the set's own table; 0: not checked
  uint64_t drawn;
};

const Model kModels[] = {
    {"Box/Box.glb", 12, 12},
    {"BoxWithSpaces/Box With Spaces.gltf", 12, 12},
    {"BoxTexturedNonPowerOfTwo/BoxTexturedNonPowerOfTwo.glb", 12, 12},
    {"BoxAnimated/BoxAnimated.glb", 254, 254},
    {"Duck/Duck.glb", 4212, 4212},
    {"DuckQuantized/Duck.gltf", 4212, 4212},
    {"WaterBottle/WaterBottle.gltf", 4510, 4510},
    {"FlightHelmet/FlightHelmet.gltf", 94722, 94722},
    {"Sponza/Sponza.gltf", 129316, 262249},
    {"GasStation/GasStation.gltf", 57246, 99002},
    {"GodotLivingRoom/living_room.glb", 5088, 5088},
    {"Lodge/lodge.glb", 7708, 7708},
    {"CornellBox/CornellBox.glb", 36, 36},
    {"MixedLighting/MixedLightingExample.gltf", 40898, 40898},
    {"DepthOfFieldExample/DepthOfFieldExample.glb", 10610, 10610},
    {"LightsPunctualLamp/LightsPunctualLamp.gltf", 6000, 6000},
    {"TransmissionTest/TransmissionTest.glb", 128775, 128775},
    {"AttenuationTest/AttenuationTest.glb", 232, 292},
    {"ClearCoatTest/ClearCoatTest.glb", 37116, 37116},
    {"SheenChair/SheenChair.gltf", 39936, 39936},
    {"IridescenceLamp/IridescenceLamp.gltf", 18866, 18866},
    {"AnisotropyBarnLamp/AnisotropyBarnLamp.gltf", 10203, 10203},
    {"AnisotropyStrengthTest/AnisotropyStrengthTest.glb", 97240, 97240},
    {"DispersionTest/dispersion-test.glb", 51827, 51827},
    {"SpecularTest/SpecularTest.glb", 44828, 44828},
    {"EmissiveStrengthTest/EmissiveStrengthTest.glb", 90, 90},
    {"GlassVaseFlowers/GlassVaseFlowers.glb", 10218, 14036},
    {"SunglassesKhronos/SunglassesKhronos.glb", 13396, 13396},
    {"UnlitTest/UnlitTest.glb", 88, 88},
    {"AlphaBlendModeTest/AlphaBlendModeTest.glb", 61, 61},
    {"NormalTangentMirrorTest/NormalTangentMirrorTest.glb", 5240, 5240},
    {"TextureTransformTest/TextureTransformTest.gltf", 18, 24},
    {"TextureSettingsTest/TextureSettingsTest.glb", 72, 72},
    {"TextureLinearInterpolationTest/TextureLinearInterpolationTest.glb", 642, 642},
    {"MultiUVTest/MultiUVTest.glb", 12, 12},
    {"VertexColorTest/VertexColorTest.glb", 36, 36},
    {"MeshPrimitiveModes/MeshPrimitiveModes.gltf", 16, 16},
    {"NegativeScaleTest/NegativeScaleTest.glb", 3884, 7724},
    {"TwoSidedPlane/TwoSidedPlane.gltf", 2, 2},
    {"MorphPrimitivesTest/MorphPrimitivesTest.glb", 32, 32},
    {"SimpleSkin/SimpleSkin.gltf", 8, 8},
    {"CesiumMan/CesiumMan.glb", 4672, 4672},
    {"SimpleInstancing/SimpleInstancing.glb", 12, 1500},
    {"SimpleSparseAccessor/SimpleSparseAccessor.gltf", 12, 12},
    {"Cameras/Cameras.gltf", 2, 2},
    {"MetalRoughSpheresNoTextures/MetalRoughSpheresNoTextures.glb", 1040409, 1040409},
    {"MonoblocChair/plastic_monobloc_chair_01_1k.gltf", 3356, 3356},
};

/// The file of a model, or an empty path where the set is not on this machine.
fs::path ModelFile(const std::string& name) {
  const fs::path path = fs::path(CARPOOL_MODELS) / name;
  return fs::exists(path) ? path : fs::path();
}

/// What must hold of any import: every index and reference in range, every float finite.
void ExpectSound(const ImportedScene& scene) {
  const stages::GeometryTables& tables = scene.geometry;
  const auto finite = [](float x) { return std::isfinite(x); };
  EXPECT_TRUE(std::all_of(tables.floats.begin(), tables.floats.end(), finite));
  for (const stages::MeshVertex& v : tables.vertices) {
    ASSERT_TRUE(std::all_of(v.position, v.position + 3, finite));
    ASSERT_TRUE(std::all_of(v.uv, v.uv + 2, finite));
  }
  for (const stages::Shape& shape : tables.shapes) {
    for (int i = 0; i < shape.triangle_count * 3; ++i) {
      ASSERT_LT(tables.indices.at(shape.first_index + i),
                static_cast<uint32_t>(shape.vertex_count));
    }
    ASSERT_LE(static_cast<size_t>(shape.first_vertex + shape.vertex_count), tables.vertices.size());
    ASSERT_LT(static_cast<size_t>(shape.material), scene.materials.size());
    for (int v = 0; v < shape.vertex_count; ++v) {
      const float* n = tables.vertices[shape.first_vertex + v].normal;
      ASSERT_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], shape.smooth ? 1 : 0, 1e-5);
    }
    for (int v = 0; v < (shape.tangents == stages::kNone ? 0 : shape.vertex_count); ++v) {
      const float* t = &tables.floats[shape.tangents + 4 * v];
      ASSERT_NEAR(t[0] * t[0] + t[1] * t[1] + t[2] * t[2], 1, 1e-5);
      ASSERT_EQ(std::fabs(t[3]), 1);
    }
  }
  for (const stages::MeshInstance& instance : tables.instances) {
    ASSERT_LT(static_cast<size_t>(instance.mesh), tables.meshes.size());
    ASSERT_LE(static_cast<size_t>(instance.object), scene.node_names.size());
  }
  for (const stages::Material& material : scene.materials) {
    for (int slot : material.slots) ASSERT_LT(slot, static_cast<int>(scene.slots.size()));
  }
  for (const TextureSource& source : scene.texture_sources) {
    EXPECT_FALSE(scene.images.at(source.image).bytes.empty());
  }
}

class ModelTest : public ::testing::TestWithParam<Model> {};

TEST_P(ModelTest, LoadsWithItsTriangles) {
  const fs::path path = ModelFile(GetParam().file);
  if (path.empty()) GTEST_SKIP() << "the development set of models is not on this machine";
  const ImportedScene scene = LoadGltf(path);
  EXPECT_EQ(scene.summary.triangles_stored, GetParam().stored);
  EXPECT_EQ(scene.summary.triangles_drawn, GetParam().drawn);
  ExpectSound(scene);
}

std::string TestName(const ::testing::TestParamInfo<Model>& info) {
  std::string name = fs::path(info.param.file).parent_path().string();
  std::erase(name, '-');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Set, ModelTest, ::testing::ValuesIn(kModels), TestName);

TEST(Models, DracoIsRefusedByName) {
  const fs::path path = ModelFile("BoxDraco/Box.gltf");
  if (path.empty()) GTEST_SKIP() << "the development set of models is not on this machine";
  EXPECT_THAT(
      ErrorOf(path),
      HasSubstr("/extensionsRequired/0: the file requires extension 'KHR_draco_mesh_compression'"));
}

TEST(Models, AssetGeneratorFilesLoad) {
  if (ModelFile("AssetGenerator-PrimitiveMode").empty()) {
    GTEST_SKIP() << "the development set of models is not on this machine";
  }
  int files = 0;
  for (const char* folder : {"AssetGenerator-PrimitiveMode", "AssetGenerator-VertexColor"}) {
    for (const fs::directory_entry& entry : fs::directory_iterator(ModelFile(folder))) {
      if (entry.path().extension() != ".gltf") continue;
      const ImportedScene scene = LoadGltf(entry.path());
      ExpectSound(scene);
      // Modes 00-03 and 07-10 are points and lines; all others draw the same square.
      EXPECT_TRUE(scene.summary.triangles_drawn == 2 || scene.geometry.instances.empty())
          << entry.path();
      ++files;
    }
  }
  EXPECT_EQ(files, 22);
}

/// All TANGENT streams of a file against those this project makes: the share of corners that agree
/// in sign and within 0.3 degrees.
double AgreementWithGivenTangents(const fs::path& path) {
  gltf::Document document = gltf::OpenDocument(path, {});
  size_t agreed = 0, corners = 0;
  for (size_t m = 0; m < document.Items("meshes").size(); ++m) {
    const Json& primitives = document.Items("meshes")[m]["primitives"];
    for (size_t p = 0; p < primitives.size(); ++p) {
      if (!primitives[p]["attributes"].contains("TANGENT")) continue;
      gltf::MaterialNeeds needs;
      needs.uv_sets = {0};
      needs.tangents = true;
      std::optional<gltf::Primitive> given =
          gltf::DecodePrimitive(document, static_cast<int>(m), static_cast<int>(p), needs);
      gltf::MendNormals(document, *given);
      gltf::Primitive made = *given;
      made.tangents.clear();
      const float kNoTransform[6] = {1, 0, 0, 0, 1, 0};
      gltf::GenerateTangents(made, 0, kNoTransform);
      for (size_t c = 0; c < made.indices.size(); ++c) {
        const gltf::Vec3 a = gltf::Primitive::At(given->tangents, 4, given->indices[c]);
        const gltf::Vec3 b = gltf::Primitive::At(made.tangents, 4, made.indices[c]);
        const bool same_sign =
            given->tangents[given->indices[c] * 4 + 3] == made.tangents[made.indices[c] * 4 + 3];
        agreed += same_sign && gltf::Dot(a, b) > 0.99999;
        ++corners;
      }
    }
  }
  return corners == 0 ? -1 : static_cast<double>(agreed) / static_cast<double>(corners);
}

// Blender makes its tangents with MikkTSpace's own code, so these files are that code's answers.
// (Files from Maya and 3ds Max carry tangents by other rules, which agree to some degrees only.)
TEST(Models, TangentsAreThoseOfMikkTSpace) {
  for (const char* file : {"NormalTangentMirrorTest/NormalTangentMirrorTest.glb",
                           "AlphaBlendModeTest/AlphaBlendModeTest.glb",
                           "AnisotropyStrengthTest/AnisotropyStrengthTest.glb"}) {
    const fs::path path = ModelFile(file);
    if (path.empty()) GTEST_SKIP() << "the development set of models is not on this machine";
    EXPECT_EQ(AgreementWithGivenTangents(path), 1.0) << file;
  }
}

class OwnScene : public ::testing::TestWithParam<const char*> {};

TEST_P(OwnScene, LoadsWithoutAWarning) {
  std::vector<std::string> warnings;
  const ImportedScene scene = LoadGltf(fs::path(CARPOOL_SCENES) / GetParam(), Collect(warnings));
  EXPECT_THAT(warnings, ::testing::IsEmpty());
  EXPECT_EQ(scene.cameras.size(), 1u);
  ExpectSound(scene);
}

INSTANTIATE_TEST_SUITE_P(Small, OwnScene,
                         ::testing::Values("cornell_box.gltf", "furnace.gltf", "materials.gltf"));

/// Six times the volume that an instance's triangles enclose, seen from `eye`: negative where they
/// face it.
double SignedVolume(const ImportedScene& scene, const stages::MeshInstance& instance,
                    const gltf::Vec3& eye) {
  const stages::GeometryTables& tables = scene.geometry;
  const stages::Shape& shape = tables.shapes[tables.meshes[instance.mesh].first_shape];
  double volume = 0;
  for (int t = 0; t < shape.triangle_count; ++t) {
    gltf::Vec3 corners[3];
    for (int c = 0; c < 3; ++c) {
      const uint32_t vertex = tables.indices[shape.first_index + 3 * t + c];
      const float* p = tables.vertices[shape.first_vertex + vertex].position;
      const gltf::Vec3 world = gltf::TransformPoint(instance.object_to_world, {p[0], p[1], p[2]});
      corners[c] = gltf::Subtract(world, eye);
    }
    volume += gltf::Dot(corners[0], gltf::Cross(corners[1], corners[2]));
  }
  return volume;
}

TEST(OwnScenes, SurfacesFaceTheRightWay) {
  const ImportedScene box = LoadGltf(fs::path(CARPOOL_SCENES) / "cornell_box.gltf");
  for (const stages::MeshInstance& instance : box.geometry.instances) {
    const std::string& name = box.node_names[instance.object - 1];
    const bool block = name.find("block") != std::string::npos;
    // Walls and lamp face the middle of the room. Blocks have no bottom; from the floor that adds
    // nothing.
    const double volume = SignedVolume(box, instance, {0, block ? 0.0 : 1.0, 0});
    EXPECT_EQ(volume < 0, !block) << name;
  }
  const ImportedScene furnace = LoadGltf(fs::path(CARPOOL_SCENES) / "furnace.gltf");
  ASSERT_EQ(furnace.geometry.instances.size(), 2u);
  EXPECT_NEAR(SignedVolume(furnace, furnace.geometry.instances[0], {0, 0, 0}), -6 * 64, 1e-4);
  EXPECT_GT(SignedVolume(furnace, furnace.geometry.instances[1], {0, 0, 0}), 6 * 4.0);
}

}  // namespace
}  // namespace carpool::render
