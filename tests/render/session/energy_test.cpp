// Rendered energy against closed forms: furnaces and form factors. Tolerances are 0.3 %; the noise
// of each estimate, from the image's own standard error, is far below it, so that a false alarm is
// a matter of many sigmas.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "tests/render/session/render_once.h"

namespace carpool::test {
namespace {

using render::RenderSettings;

constexpr double kPi = 3.14159265358979323846;

class Energy : public testing::Test {
 protected:
  RenderSettings Settings(const SceneBuilder& builder, const std::string& name) const {
    RenderSettings s;
    s.scene_path = builder.Write(folder_.path(), name).string();
    s.width = 48;
    s.height = 48;
    s.samples = 256;
    s.threads = 2;
    return s;
  }
  ScratchFolder folder_;
};

/// Inside a closed Lambert box that glows: L = Le (1 - rho^(k+1)) / (1 - rho) at k scattering
/// events.
TEST_F(Energy, ClosedFurnaceCutAtAnyDepth) {
  const double rho = 0.8, emission = 0.5;
  SceneBuilder b;
  b.PlaceMesh(b.AddBox(1, b.AddLambert({rho, rho, rho}, {emission, emission, emission}), true));
  b.AddCamera({0.1, 0.2, 0.3}, 1.2);
  for (const int depth : {0, 1, 2, 5, 60}) {
    RenderSettings s = Settings(b, "furnace");
    s.max_depth = depth;
    const double expected = emission * (1 - std::pow(rho, depth + 1)) / (1 - rho);
    EXPECT_NEAR(MeanOf(RenderOnce(s).image, "G") / expected, 1, 0.003) << "depth " << depth;
  }
}

/// A point straight below the middle of a 2 x 2 light at height 1 receives E = 0.55413 pi L
/// (HARD_CASES row 26).
TEST_F(Energy, QuadLightAtUnitHeight) {
  const double radiance = 2, rho = 0.5;
  SceneBuilder b;
  const int lamp = b.AddLambert({0, 0, 0}, {1, 1, 1}, radiance);
  const int floor = b.AddLambert({rho, rho, rho});
  b.PlaceMesh(b.AddQuad({-1, 1, -1}, {1, 1, -1}, {1, 1, 1}, {-1, 1, 1}, lamp));
  b.PlaceMesh(b.AddQuad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}, floor));
  // Below the lamp, looking down at a patch so small that its irradiance is the centre's.
  b.json()["cameras"] = {
      {{"type", "orthographic"},
       {"orthographic", {{"xmag", 0.01}, {"ymag", 0.01}, {"znear", 0}, {"zfar", 10}}}}};
  b.AddNode({{"camera", 0},
             {"translation", {0, 0.5, 0}},
             {"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}}});
  RenderSettings s = Settings(b, "quad");
  s.max_depth = 1;
  const double expected = rho / kPi * 0.55413 * kPi * radiance;
  EXPECT_NEAR(MeanOf(RenderOnce(s).image, "G") / expected, 1, 0.003);
}

/// Candela and lux: E = I / d2 and E = lux on a surface that faces the light; radiance rho E / pi.
TEST_F(Energy, PunctualUnits) {
  const double rho = 0.6;
  for (const bool directional : {false, true}) {
    SceneBuilder b;
    b.PlaceMesh(
        b.AddQuad({-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}, b.AddLambert({rho, rho, rho})));
    b.json()["extensionsUsed"].push_back("KHR_lights_punctual");
    b.json()["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", directional ? "directional" : "point"}, {"intensity", 12}}};
    b.AddNode(
        {{"translation", {0, 0, 2}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    b.AddCamera({0, 0, 1}, 0.01);
    const double irradiance = directional ? 12 : 12 / 4.0;
    EXPECT_NEAR(MeanOf(RenderOnce(Settings(b, "punctual")).image, "G") / (rho * irradiance / kPi),
                1, 0.003)
        << (directional ? "directional" : "point");
  }
}

/// A white sphere of any roughness, metal or not, under a white sky vanishes into it.
TEST_F(Energy, WhiteSpheresUnderAWhiteSky) {
  for (const double metallic : {0.0, 1.0}) {
    for (const double roughness : {0.0, 0.3, 0.7, 1.0}) {
      SceneBuilder b;
      const int white = b.AddMaterial({{"pbrMetallicRoughness",
                                        {{"baseColorFactor", {1, 1, 1, 1}},
                                         {"metallicFactor", metallic},
                                         {"roughnessFactor", roughness}}}});
      b.PlaceMesh(b.AddSphere(1, 64, white, false));
      b.AddCamera({0, 0, 4}, 0.3);
      RenderSettings s = Settings(b, "sphere");
      const std::filesystem::path sky = folder_.path() / "white.hdr";
      std::ofstream(sky, std::ios::binary) << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n"
                                           << std::string("\x80\x80\x80\x81", 4);
      s.env_path = sky.string();
      s.max_depth = 32;
      EXPECT_NEAR(MeanOf(RenderOnce(s).image, "G"), 1, 0.003)
          << "metallic " << metallic << ", roughness " << roughness;
    }
  }
}

}  // namespace
}  // namespace carpool::test
