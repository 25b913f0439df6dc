// Random scales, places, rotations, brightnesses and scenes.
#include "tests/hard_cases/variations.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <numeric>

namespace carpool::test {
namespace {

using nlohmann::json;
using std::numbers::pi;

double Uniform(std::mt19937& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}

/// 10^x, x uniform.
double Decades(std::mt19937& rng, double low, double high) {
  return std::pow(10.0, Uniform(rng, low, high));
}

json RandomRotation(std::mt19937& rng) {
  std::normal_distribution<double> normal;
  double q[4], squares = 0;
  for (double& x : q) {
    x = normal(rng);
    squares += x * x;
  }
  json rotation = json::array();
  for (const double x : q) rotation.push_back(x / std::sqrt(squares));
  return rotation;
}

/// Puts everything under one node.
void Place(SceneBuilder& scene, json parent) {
  json& roots = scene.json()["scenes"][0]["nodes"];
  parent["children"] = roots;
  roots = json::array();
  scene.AddNode(parent);
}

void ScaleNumber(json& object, const char* key, double factor) {
  if (object.contains(key)) object[key] = object[key].get<double>() * factor;
}

/// What a node's scale leaves alone: the extent of cameras, the reach and intensity of lamps.
void ScaleCamerasAndLamps(json& document, double scale) {
  for (json& camera : document["cameras"]) {
    if (!camera.contains("orthographic")) continue;
    for (const char* key : {"xmag", "ymag", "znear", "zfar"})
      ScaleNumber(camera["orthographic"], key, scale);
  }
  if (!document.contains("extensions")) return;
  for (json& light : document["extensions"]["KHR_lights_punctual"]["lights"]) {
    ScaleNumber(light, "range", scale);
    if (light["type"] != "directional") ScaleNumber(light, "intensity", scale * scale);
  }
}

void Brighten(SceneCase& scene, double factor) {
  json& document = scene.scene.json();
  for (json& material : document["materials"]) {
    if (!material.contains("emissiveFactor")) continue;
    json& strength = material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"];
    strength = (strength.is_null() ? 1.0 : strength.get<double>()) * factor;
  }
  json& used = document["extensionsUsed"];
  if (std::find(used.begin(), used.end(), "KHR_materials_emissive_strength") == used.end())
    used.push_back("KHR_materials_emissive_strength");
  if (document.contains("extensions")) {
    for (json& light : document["extensions"]["KHR_lights_punctual"]["lights"])
      ScaleNumber(light, "intensity", factor);
  }
  for (float& texel : scene.sky.rgb) texel *= static_cast<float>(factor);
}

bool IsUniform(const Sky& sky) {
  return std::all_of(sky.rgb.begin(), sky.rgb.end(), [&](float v) { return v == sky.rgb[0]; });
}

json FurnaceMaterial(double rho, double emission, bool double_sided) {
  return {
      {"pbrMetallicRoughness", {{"baseColorFactor", {rho, rho, rho, 1}}, {"metallicFactor", 0}}},
      {"emissiveFactor", {emission, emission, emission}},
      {"doubleSided", double_sided},
      {"extensions", {{"KHR_materials_specular", {{"specularFactor", 0}}}}}};
}

Point InBox(std::mt19937& rng, double half) {
  return {Uniform(rng, -half, half), Uniform(rng, -half, half), Uniform(rng, -half, half)};
}

/// A triangle around `at`; one in four is a needle.
void AddTriangle(std::mt19937& rng, const Point& at, std::vector<Point>& points) {
  const double size = Decades(rng, -4, 0), thin = rng() % 4 == 0 ? Decades(rng, -6, -1) : 1;
  std::normal_distribution<double> normal;
  const Point along = {size * normal(rng), size * normal(rng), size * normal(rng)};
  points.push_back(at);
  for (const double s : {0.0, 1.0}) {
    Point p = at;
    for (int i = 0; i < 3; ++i) p[i] += s * along[i] + thin * size * normal(rng);
    points.push_back(p);
  }
}

/// Irradiance over pi of a floor at the origin facing +y, under a triangle of radiance 1 that is
/// above it altogether (Lambert's polygon formula).
double FormFactor(const Point& a, const Point& b, const Point& c) {
  const Point corners[3] = {a, b, c};
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    const Point &p = corners[i], &q = corners[(i + 1) % 3];
    const double cross[3] = {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2],
                             p[0] * q[1] - p[1] * q[0]};
    const double sine = std::hypot(cross[0], cross[1], cross[2]);
    if (sine == 0) continue;
    const double cosine = p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    sum += std::atan2(sine, cosine) * cross[1] / sine;
  }
  return std::abs(sum) / (2 * pi);
}

}  // namespace

std::string Variation::Text() const {
  char text[96];
  std::snprintf(text, sizeof text, "scale %.3g, %.3g m away, brightness %.3g", scale, offset,
                brightness);
  return text;
}

Variation Vary(SceneCase& scene, double expected, std::mt19937& rng) {
  Variation v;
  v.scale = Decades(rng, -6, 6);
  // Node matrices are in double: 2^-52 of the offset is below 1e-6 of the scene's size.
  v.offset = std::min({Decades(rng, 0, 6) - 1, 1e6, 1e9 * v.scale});
  // Means over twelve decades of what the film holds, which is 2^-32 to 2^30.
  v.brightness = Decades(rng, -7, 5) / expected;
  std::normal_distribution<double> normal;
  const double s = v.scale, o = v.offset;
  json parent = {{"scale", {s, s, s}},
                 {"translation", {o * normal(rng), o * normal(rng), o * normal(rng)}}};
  if (IsUniform(scene.sky)) parent["rotation"] = RandomRotation(rng);
  ScaleCamerasAndLamps(scene.scene.json(), s);
  Brighten(scene, v.brightness);
  Place(scene.scene, parent);
  return v;
}

ClosedForm RandomWhiteSphere(std::mt19937& rng) {
  const double metallic = Uniform(rng, -0.5, 1.5), roughness = Uniform(rng, -0.1, 1);
  SceneCase c{.name = "soak_white_sphere"};
  c.scene.PlaceMesh(c.scene.AddSphere(
      1, 48,
      AddWhite(c.scene, std::clamp(metallic, 0.0, 1.0), std::pow(std::max(roughness, 0.0), 3)),
      false));
  c.scene.AddCamera({0, 0, 4}, 0.3);
  c.settings = HardSettings(128, 32);
  c.sky = UniformSky(1);
  return {16, c, {.expected = 1, .slack = 0.002}};
}

ClosedForm RandomFurnace(std::mt19937& rng) {
  const int depth = static_cast<int>(rng() % 9);
  const double rho = Uniform(rng, 0, 0.95), emission = 0.5;
  SceneCase c{.name = "soak_furnace_depth_" + std::to_string(depth)};
  SceneBuilder& b = c.scene;
  b.PlaceMesh(b.AddBox(1, b.AddMaterial(FurnaceMaterial(rho, emission, false)), true));
  const int junk = b.AddMaterial(FurnaceMaterial(rho, emission, true));
  const Point eye = InBox(rng, 0.9);
  std::vector<Point> points;
  std::vector<uint32_t> indices;
  for (uint32_t left = 1 + rng() % 100; left > 0; --left)
    AddTriangle(rng, rng() % 4 == 0 ? eye : InBox(rng, 0.9), points);
  for (uint32_t i = 0; i < points.size(); ++i) indices.push_back(i);
  b.PlaceMesh(b.AddMesh(points, indices, junk));
  for (uint32_t i = rng() % 4; i > 0; --i)
    b.PlaceMesh(b.AddSphere(Decades(rng, -3, 0), 8, junk, rng() % 2 == 0),
                rng() % 2 == 0 ? eye : InBox(rng, 0.9));
  b.AddCamera(eye, 1.2);
  c.settings = HardSettings(64, depth);
  return {12, c, {.expected = emission * (1 - std::pow(rho, depth + 1)) / (1 - rho)}};
}

ClosedForm DomeOfLights(int rings, std::mt19937& rng) {
  constexpr double kRho = 0.5;
  constexpr int kDecades = 13;
  SceneCase c{.name = "soak_dome_of_lights"};
  SceneBuilder& b = c.scene;
  b.PlaceMesh(
      b.AddQuad({-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}, b.AddLambert({kRho, kRho, kRho})));
  std::vector<Point> points;
  for (int y = 0; y <= rings; ++y) {
    for (int x = 0; x < 2 * rings; ++x) {
      const double up = 0.01 + (pi / 2 - 0.01) * y / rings, phi = pi * x / rings;
      points.push_back(
          {3 * std::cos(up) * std::cos(phi), 3 * std::sin(up), 3 * std::cos(up) * std::sin(phi)});
    }
  }
  std::vector<Point> lamps[kDecades];
  double sum = 0;
  for (int y = 0; y < rings; ++y) {
    for (int x = 0; x < 2 * rings; ++x) {
      const auto at = [&](int row, int column) {
        return static_cast<uint32_t>(row * 2 * rings + column % (2 * rings));
      };
      const uint32_t corners[6] = {at(y, x),     at(y, x + 1),     at(y + 1, x),
                                   at(y, x + 1), at(y + 1, x + 1), at(y + 1, x)};
      for (int k = 0; k < 6; k += 3) {  // counter-clockwise from within
        const int decade = static_cast<int>(rng() % kDecades);
        for (int i = k; i < k + 3; ++i) lamps[decade].push_back(points[corners[i]]);
        sum += std::pow(10.0, decade - 9) *
               FormFactor(points[corners[k]], points[corners[k + 1]], points[corners[k + 2]]);
      }
    }
  }
  for (int decade = 0; decade < kDecades; ++decade) {
    const double radiance = std::pow(10.0, decade - 9);
    const int lamp = b.AddLambert({0, 0, 0}, {1, 1, 1}, radiance);
    std::vector<uint32_t> indices(lamps[decade].size());
    std::iota(indices.begin(), indices.end(), 0u);
    b.PlaceMesh(b.AddMesh(lamps[decade], indices, lamp));
  }
  b.AddCameraAbove({0, 0.2, 0}, 1e-4);
  c.settings = HardSettings(128, 1);
  return {33, c, {.expected = kRho * sum}};
}

}  // namespace carpool::test
