// Scenes that are broken, empty or extreme: every sample is finite and not negative, none is
// rejected, and what was replaced on the way is said.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/hard_cases/checks.h"
#include "tests/hard_cases/scenes.h"
#include "tests/render/session/render_once.h"

namespace carpool::test {
namespace {

/// Renders; every pixel is finite and at least 0, and the ledger is empty.
double ExpectSound(const SceneCase& scene) {
  const ScratchFolder folder;
  const Rendered rendered = RenderOnce(WriteCase(scene, folder.path()));
  uint64_t broken = 0;
  for (const char* channel : {"R", "G", "B"}) {
    for (const float value : *rendered.image.FindFloats(channel))
      broken += !(std::isfinite(value) && value >= 0);
  }
  EXPECT_EQ(broken, 0u) << scene.name << "\n  alone: " << RenderCommand(scene, 0);
  EXPECT_EQ(rendered.summary.ledger.Count(), 0u) << scene.name;
  return MeanOf(rendered.image, "G");
}

SceneCase Empty(const std::string& name) {
  SceneCase c{.name = name};
  c.scene.AddCamera({0, 0, 3}, 0.8);
  c.settings = HardSettings(32, 6);
  return c;
}

/// Row 5: no area, no width, twice the same; lit, and shining themselves.
TEST(HardRow05, SliversZeroAreaAndDuplicates) {
  for (const bool shining : {false, true}) {
    SceneCase c = Empty("slivers");
    SceneBuilder& b = c.scene;
    const int material =
        shining ? b.AddLambert({0.5, 0.5, 0.5}, {1, 1, 1}, 3) : AddWhite(b, 0.5, 0.3);
    b.PlaceMesh(b.AddMesh(
        {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {0, -1, 0}, {1e-20, -1, 0}, {0.5, 0.5, 1e-30}},
        {0, 1, 2, 0, 1, 2, 2, 1, 0, 0, 0, 1, 3, 3, 3, 0, 3, 1, 3, 4, 2, 1, 2, 5}, material));
    b.PlaceMesh(b.AddBox(2.5, b.AddLambert({0.5, 0.5, 0.5}, {0.1, 0.1, 0.1}), true));
    b.AddPunctual({{"type", "point"}, {"intensity", 5}}, {{"translation", {0, 0, 1}}});
    EXPECT_GT(ExpectSound(c), 0.05);
  }
}

/// Row 29: receivers in the plane of a lamp, on it, inside it; the camera inside a lamp and a mesh.
TEST(HardRow29, ReceiversOnAndInsideEmitters) {
  SceneCase c = Empty("on_the_lamp");
  SceneBuilder& b = c.scene;
  const int lamp = b.AddLambert({0.5, 0.5, 0.5}, {1, 1, 1}, 10);
  const int grey = AddWhite(b, 0, 0.2);
  b.PlaceMesh(b.AddQuad({-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2}, grey));
  b.PlaceMesh(b.AddQuad({-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}, lamp));
  b.PlaceMesh(b.AddSphere(0.5, 8, lamp, false), {0, 0.2, 0});
  b.PlaceMesh(b.AddSphere(3.5, 8, lamp, true));
  b.PlaceMesh(b.AddSphere(0.3, 8, grey, false), {0, 0, 3});
  b.AddPunctual({{"type", "point"}, {"intensity", 1}}, {{"translation", {0.1, 0, 0.1}}});
  EXPECT_GT(ExpectSound(c), 1e-3);
}

/// Row 36: texels that are no radiances are replaced and counted; half's largest number is kept.
TEST(HardRow36, SkiesWithBrokenTexels) {
  SceneCase c = Empty("broken_sky");
  SceneBuilder& b = c.scene;
  b.PlaceMesh(b.AddSphere(1, 24, AddWhite(b, 0.3, 0.4), false));
  c.sky = {8, 4, std::vector<float>(8 * 4 * 3, 0.5f)};
  c.sky.rgb[5] = std::numeric_limits<float>::quiet_NaN();
  c.sky.rgb[20] = std::numeric_limits<float>::infinity();
  c.sky.rgb[40] = -3;
  c.sky.rgb[60] = 65504;
  EXPECT_GT(ExpectSound(c), 0.1);

  const ScratchFolder folder;
  render::RenderSettings settings = WriteCase(c, folder.path());
  settings.output_path = (folder.path() / "image.exr").string();
  settings.samples = 1;
  std::string warnings;
  const std::atomic<bool> stop{false};
  render::Render(settings, stop, {}, [&](const std::string& line) { warnings += line + "\n"; });
  EXPECT_NE(warnings.find("texels"), std::string::npos) << warnings;
}

TEST(HardRow36, HugeTextureCoordinates) {
  SceneCase c = Empty("huge_uv");
  SceneBuilder& b = c.scene;
  const int texture = b.AddTexture(2, 2, {255, 255, 255, 0, 0, 0, 0, 0, 0, 255, 255, 255});
  const int material =
      b.AddMaterial({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}});
  for (const double far : {1e6, -1e6, 1e30}) {
    b.PlaceMesh(b.AddMesh({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}}, {0, 1, 2}, material,
                          {{far, far}, {far + 1, far}, {far + 1, far + 1}}));
  }
  c.sky = UniformSky(1);
  EXPECT_GT(ExpectSound(c), 0.1);
}

/// Row 37: a bent normal never creates light: a white Lambert sheet under a white sky returns at
/// most 1; what is lost is printed.
TEST(HardRow37, NormalMapsBelowTheHorizonCreateNoLight) {
  struct Texel {
    const char* name;
    uint8_t x, y, z;
  };
  for (const Texel texel : {Texel{"flat", 128, 128, 255}, Texel{"slanted", 230, 128, 200},
                            Texel{"horizon", 255, 128, 128}, Texel{"below", 200, 128, 20},
                            Texel{"zero", 128, 128, 128}}) {
    SceneCase c{.name = std::string("row37_") + texel.name};
    SceneBuilder& b = c.scene;
    const int map = b.AddTexture(1, 1, {texel.x, texel.y, texel.z});
    nlohmann::json white = {{"pbrMetallicRoughness", {{"metallicFactor", 0}}},
                            {"normalTexture", {{"index", map}}},
                            {"extensions", {{"KHR_materials_specular", {{"specularFactor", 0}}}}}};
    b.PlaceMesh(b.AddQuad({-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}, b.AddMaterial(white)));
    b.AddCamera({0, 0, 1}, 0.5);
    c.settings = HardSettings(64, 4);
    c.sky = UniformSky(1);
    const Mean mean = CaseRenderer(c).Seeds(kFirstSeed, 16);
    std::printf("row 37, %s: %.4f of the light is lost\n", texel.name, 1 - mean.Value());
    EXPECT_LE(mean.Value(), 1 + kRounding + 7.6 * mean.Error()) << texel.name;
    EXPECT_GT(mean.Value(), 0.1) << texel.name;
  }
}

/// Row 8: smooth normals on a coarse sphere: rays below the real surface are lost, none is made.
TEST(HardRow08, SmoothNormalsOnCoarseSpheresCreateNoLight) {
  for (const int rings : {4, 8, 16, 64}) {
    SceneCase c{.name = "row08_sphere_of_" + std::to_string(rings)};
    SceneBuilder& b = c.scene;
    b.PlaceMesh(b.AddSphere(1, rings, b.AddLambert({1, 1, 1}), false, true));
    b.AddCamera({0, 0, 6}, 0.15);
    c.settings = HardSettings(64, 16);
    c.sky = UniformSky(1);
    const Mean mean = CaseRenderer(c).Seeds(kFirstSeed, 16);
    std::printf("row 8, %d rings: %.5f of the light is lost\n", rings, 1 - mean.Value());
    EXPECT_LE(mean.Value(), 1 + kRounding + 7.6 * mean.Error()) << rings;
    EXPECT_GT(mean.Value(), 0.9) << rings;
  }
}

/// Row 47: nothing to see, nothing to see by.
TEST(HardRow47, EmptyScenesAndScenesWithoutLight) {
  SceneCase nothing{.name = "nothing"};
  nothing.settings = HardSettings(4, 4);
  ExpectSound(nothing);
  ExpectSound(Empty("camera_alone"));

  SceneCase dark = Empty("dark");
  SceneBuilder& b = dark.scene;
  b.PlaceMesh(b.AddBox(2.5, AddWhite(b, 1, 0), true));
  b.AddPunctual({{"type", "point"}, {"intensity", 0}}, {{"translation", {0, 0, 1}}});
  EXPECT_EQ(ExpectSound(dark), 0);

  SceneCase black = Empty("black_sky");
  black.scene.PlaceMesh(black.scene.AddSphere(1, 8, AddWhite(black.scene, 0, 1), false));
  black.sky = {4, 2, std::vector<float>(4 * 2 * 3, 0)};
  EXPECT_EQ(ExpectSound(black), 0);
}

TEST(HardRow47, ZeroNormalsAndMissingTangents) {
  SceneCase c = Empty("zero_normals");
  SceneBuilder& b = c.scene;
  const int map = b.AddTexture(1, 1, {200, 60, 220});
  const int material = b.AddMaterial({{"normalTexture", {{"index", map}}}});
  b.PlaceMesh(b.AddMesh({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}}, {0, 1, 2}, material,
                        {{0, 0}, {0, 0}, {0, 0}}, {{0, 0, 0}, {0, 0, 0}, {0, 0, 1}}));
  c.sky = UniformSky(1);
  EXPECT_GT(ExpectSound(c), 0.1);
}

/// Row 10: an object without volume is a sheet; without area it is nothing.
TEST(HardRow10, ZeroScalesVanishQuietly) {
  SceneCase c = Empty("vanished");
  SceneBuilder& b = c.scene;
  const int mesh = b.AddSphere(1, 8, b.AddLambert({0, 0, 0}), false);
  for (const Point& scale : {Point{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})
    b.AddNode({{"mesh", mesh}, {"scale", scale}});
  c.sky = UniformSky(1);
  EXPECT_NEAR(ExpectSound(c), 1, 1e-6);
}

}  // namespace
}  // namespace carpool::test
