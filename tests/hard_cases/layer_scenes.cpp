// Alpha: what N layers let through, of planes that coincide and of meshes whose edges rays meet.
#include <cmath>

#include "tests/hard_cases/scenes.h"

namespace carpool::test {
namespace {

constexpr double kAlpha = 0.3, kRadiance = 2;

/// Each layer lets a path through or not: with 2 million samples, a bias of a hundredth of the
/// coefficient of variation is seen.
Claim ThroughLayers(int layers) {
  const double p = std::pow(1 - kAlpha, layers);
  return {.expected = kRadiance * p, .precision = 0.01 * std::sqrt((1 - p) / p)};
}

int AddVeil(SceneBuilder& b) {
  return b.AddMaterial(
      {{"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, kAlpha}}, {"metallicFactor", 0}}},
       {"extensions", {{"KHR_materials_specular", {{"specularFactor", 0}}}}},
       {"alphaMode", "BLEND"},
       {"doubleSided", true}});
}

int AddLamp(SceneBuilder& b) {
  return b.AddLambert({0, 0, 0}, {1, 1, 1}, kRadiance);
}

/// A square of n x n cells facing +z, all of whose vertices and edges lie on a grid.
int AddGrid(SceneBuilder& b, double half, uint32_t n, int material) {
  std::vector<Point> points;
  std::vector<uint32_t> indices;
  for (uint32_t y = 0; y <= n; ++y) {
    for (uint32_t x = 0; x <= n; ++x)
      points.push_back({half * (2.0 * x / n - 1), half * (2.0 * y / n - 1), 0});
  }
  for (uint32_t y = 0; y < n; ++y) {
    for (uint32_t x = 0; x < n; ++x) {
      const uint32_t a = y * (n + 1) + x, c = a + n + 1;
      indices.insert(indices.end(), {a, a + 1, c + 1, a, c + 1, c});
    }
  }
  return b.AddMesh(points, indices, material);
}

/// Row 7: `layers` meshes in one plane count once each; seen by camera rays.
ClosedForm Coincident(int layers, bool lamp_too) {
  SceneCase c{.name =
                  "row07_coincident_" + std::to_string(layers) + (lamp_too ? "_on_the_lamp" : "")};
  SceneBuilder& b = c.scene;
  b.PlaceMesh(AddGrid(b, 2, 1, AddLamp(b)), {0, 0, lamp_too ? 0.0 : -1.0});
  const int veil = AddVeil(b);
  for (int i = 0; i < layers; ++i) b.PlaceMesh(AddGrid(b, 2, 1, veil));
  b.AddCamera({0.1, 0.05, 3}, 0.3);
  c.settings = HardSettings(512, 0);
  return {7, c, ThroughLayers(layers)};
}

/// Row 7: the same for shadow rays: a lamp above a floor, veils between.
ClosedForm CoincidentShadow(int layers) {
  SceneCase c{.name = "row07_shadow_of_" + std::to_string(layers)};
  SceneBuilder& b = c.scene;
  const double rho = 0.5, intensity = 10, height = 2;
  b.PlaceMesh(
      b.AddQuad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}, b.AddLambert({rho, rho, rho})));
  const int veil = AddVeil(b);
  for (int i = 0; i < layers; ++i)
    b.PlaceMesh(b.AddQuad({-1, 1, 1}, {1, 1, 1}, {1, 1, -1}, {-1, 1, -1}, veil));
  b.AddPunctual({{"type", "point"}, {"intensity", intensity}}, {{"translation", {0, height, 0}}});
  b.AddCameraAbove({0, 0.2, 0}, 1e-4);
  c.settings = HardSettings(16, 1);
  const double e = intensity / (height * height) * std::pow(1 - kAlpha, layers);
  return {7, c, {.expected = rho * e / 3.14159265358979323846}};
}

/// Row 7: an orthographic camera whose pixels all look at vertices and edges of a grid: each layer
/// counts once there, too.
ClosedForm ThroughEdges(int layers) {
  SceneCase c{.name = "row07_edges_of_" + std::to_string(layers)};
  SceneBuilder& b = c.scene;
  b.PlaceMesh(AddGrid(b, 2, 1, AddLamp(b)), {0, 0, -1});
  const int veil = AddVeil(b);
  // Pixels of 2^-14 around lines at multiples of 2^-14: filtered rays meet edges now and then.
  for (int i = 0; i < layers; ++i) b.PlaceMesh(AddGrid(b, 0x1p-8, 128, veil), {0, 0, 0.01 * i});
  b.json()["cameras"] = {
      {{"type", "orthographic"},
       {"orthographic", {{"xmag", 0x1p-9}, {"ymag", 0x1p-9}, {"znear", 0}, {"zfar", 10}}}}};
  b.AddNode({{"camera", 0}, {"translation", {0, 0, 3}}});
  c.settings = HardSettings(512, 0);
  return {7, c, ThroughLayers(layers)};
}

/// Row 35: alpha exactly at the cutoff is there; BLEND at 0 is not, at 1 it is.
ClosedForm AlphaEnds(const std::string& name, const std::string& mode, double alpha,
                     double through) {
  SceneCase c{.name = "row35_" + name};
  SceneBuilder& b = c.scene;
  b.PlaceMesh(AddGrid(b, 2, 1, AddLamp(b)), {0, 0, -1});
  const int veil = b.AddMaterial(
      {{"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, alpha}}, {"metallicFactor", 0}}},
       {"emissiveFactor", {1, 1, 1}},
       {"alphaMode", mode}});
  b.PlaceMesh(AddGrid(b, 2, 1, veil));
  b.AddCamera({0.1, 0.05, 3}, 0.3);
  c.settings = HardSettings(4, 0);
  return {35, c, {.expected = through * kRadiance + (1 - through) * 1}};
}

}  // namespace

std::vector<ClosedForm> LayerForms() {
  std::vector<ClosedForm> forms;
  for (const int layers : {1, 2, 3, 7}) forms.push_back(Coincident(layers, false));
  for (const int layers : {1, 2}) forms.push_back(Coincident(layers, true));
  for (const int layers : {1, 2, 5}) forms.push_back(CoincidentShadow(layers));
  for (const int layers : {1, 3}) forms.push_back(ThroughEdges(layers));
  forms.push_back(AlphaEnds("mask_at_cutoff", "MASK", 0.5, 0));
  forms.push_back(AlphaEnds("mask_below_cutoff", "MASK", 0.499999, 1));
  forms.push_back(AlphaEnds("blend_0", "BLEND", 0, 1));
  forms.push_back(AlphaEnds("blend_1", "BLEND", 1, 0));
  return forms;
}

}  // namespace carpool::test
