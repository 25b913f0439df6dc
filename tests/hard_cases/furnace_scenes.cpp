// Furnaces: inside or under uniform light, what returns is known for any shape.
#include <cmath>

#include "tests/hard_cases/scenes.h"

namespace carpool::test {
namespace {

/// Inside a closed Lambert box that glows: L = Le (1 - rho^(k+1)) / (1 - rho) after k scattering
/// events.
ClosedForm ClosedFurnace(int depth) {
  const double rho = 0.8, emission = 0.5;
  SceneCase c{.name = "row12_furnace_depth_" + std::to_string(depth)};
  SceneBuilder& b = c.scene;
  b.PlaceMesh(b.AddBox(1, b.AddLambert({rho, rho, rho}, {emission, emission, emission}), true));
  b.AddCamera({0.1, 0.2, 0.3}, 1.2);
  c.settings = HardSettings(depth > 5 ? 256 : 64, depth);
  return {12, c, {.expected = emission * (1 - std::pow(rho, depth + 1)) / (1 - rho)}};
}

/// Row 29: a camera within rounding of the common corner of glowing triangles that are a million
/// times larger than what it sees of them. Where their planes are, no ray can tell; what it meets
/// must count once all the same.
ClosedForm CornerOfLights() {
  const double rho = 0.8, emission = 0.5;
  constexpr int kDepth = 2, kSpikes = 40;
  SceneCase c{.name = "row29_corner_of_lights"};
  SceneBuilder& b = c.scene;
  const int material = b.AddLambert({rho, rho, rho}, {emission, emission, emission});
  b.json()["materials"][static_cast<size_t>(material)]["doubleSided"] = true;
  b.PlaceMesh(b.AddBox(1, material, true));
  const Point eye = {0.1, 0.2, 0.3};  // a corner is the nearest float to it
  const auto spike = [&](int i) {
    const double z = 1 - (2 * (i % kSpikes) + 1.0) / kSpikes, phi = 2.4 * i;
    const double r = 0.5 * std::sqrt(1 - z * z);
    return Point{eye[0] + r * std::cos(phi), eye[1] + r * std::sin(phi), eye[2] + 0.5 * z};
  };
  std::vector<Point> points = {eye};
  std::vector<uint32_t> indices;
  for (int i = 0; i < kSpikes; ++i) {
    points.push_back(spike(i));
    indices.insert(indices.end(), {0u, 1 + static_cast<uint32_t>(i),
                                   1 + static_cast<uint32_t>((i + 5) % kSpikes)});
  }
  b.PlaceMesh(b.AddMesh(points, indices, material));
  b.AddCamera(eye, 1.2);
  c.settings = HardSettings(128, kDepth);
  return {29, c, {.expected = emission * (1 - std::pow(rho, kDepth + 1)) / (1 - rho)}};
}

/// Row 29: a floor a thousandth of a millimetre under a glowing ceiling of 200 m: E = pi L.
ClosedForm UnderCeiling() {
  const double rho = 0.5, radiance = 2, height = 1e-6;
  SceneCase c{.name = "row29_under_a_ceiling"};
  SceneBuilder& b = c.scene;
  b.PlaceMesh(
      b.AddQuad({-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}, b.AddLambert({rho, rho, rho})));
  b.PlaceMesh(b.AddQuad({-100, height, -100}, {100, height, -100}, {100, height, 100},
                        {-100, height, 100}, b.AddLambert({0, 0, 0}, {1, 1, 1}, radiance)));
  b.AddCameraAbove({0, height / 2, 0}, 0.5);
  c.settings = HardSettings(128, 1);
  return {29, c, {.expected = rho * radiance}};
}

/// A surface that reflects all light vanishes before a white sky. The code declares how far each
/// (mu, roughness) may be off: 0.002.
ClosedForm WhiteSphere(double metallic, double roughness) {
  SceneCase c{.name = "row16_white_" + std::string(metallic > 0 ? "metal" : "dielectric") + "_" +
                      std::to_string(static_cast<int>(100 * roughness))};
  SceneBuilder& b = c.scene;
  b.PlaceMesh(b.AddSphere(1, 48, AddWhite(b, metallic, roughness), false));
  b.AddCamera({0, 0, 4}, 0.3);
  c.settings = HardSettings(roughness < 0.5 ? 128 : 384, 32);
  c.sky = UniformSky(1);
  return {16, c, {.expected = 1, .slack = 0.002}};
}

/// rho = 0.99: paths of hundreds of vertices, with and without Russian roulette.
ClosedForm LongPaths(int roulette) {
  const double rho = 0.99;
  SceneCase c{.name = "row44_roulette_from_" + std::to_string(roulette)};
  SceneBuilder& b = c.scene;
  b.PlaceMesh(b.AddBox(1, b.AddLambert({rho, rho, rho}, {1, 1, 1}), true));
  b.AddCamera({0.1, 0.2, 0.3}, 1.2);
  c.settings = HardSettings(roulette > 3 ? 4 : 32, render::kMaxDepth);
  c.settings.roulette_depth = roulette;
  return {44,
          c,
          {.expected = (1 - std::pow(rho, render::kMaxDepth + 1)) / (1 - rho), .precision = 0.05}};
}

}  // namespace

int AddWhite(SceneBuilder& b, double metallic, double roughness) {
  return b.AddMaterial({{"pbrMetallicRoughness",
                         {{"baseColorFactor", {1, 1, 1, 1}},
                          {"metallicFactor", metallic},
                          {"roughnessFactor", roughness}}}});
}

std::vector<ClosedForm> FurnaceForms() {
  std::vector<ClosedForm> forms;
  for (const int depth : {0, 1, 2, 5, 60}) forms.push_back(ClosedFurnace(depth));
  for (const double metallic : {0.0, 1.0}) {
    for (const double roughness : {0.0, 0.1, 0.3, 0.7, 1.0})
      forms.push_back(WhiteSphere(metallic, roughness));
  }
  forms.push_back(CornerOfLights());
  forms.push_back(UnderCeiling());
  for (const int roulette : {0, 3, 256}) forms.push_back(LongPaths(roulette));
  return forms;
}

}  // namespace carpool::test
