// Pairs of scenes that must look alike: other ways to sample, other transforms, other scales.
#include <cmath>

#include "tests/hard_cases/scenes.h"

namespace carpool::test {
namespace {

using render::DirectLight;

struct Glossy {
  const char* name;
  double metallic, roughness;
};
// Light sampling hardly ever hits a lobe much narrower than the light: below roughness 0.2 its
// noise would hide anything. (Kernels are compared down to alpha 1e-4 in tests/stages.)
constexpr Glossy kMaterials[] = {{"rough_metal", 1, 0.7},
                                 {"glossy_metal", 1, 0.35},
                                 {"rough_dielectric", 0, 0.7},
                                 {"glossy_dielectric", 0, 0.35}};

/// Row 32: a floor of one material under one light, seen at a slant, so that the lobe reaches the
/// light.
SceneCase Lit(const std::string& light, const Glossy& material, DirectLight direct) {
  SceneCase c{.name =
                  "row32_" + light + "_" + material.name + "_" + std::string(render::Name(direct))};
  SceneBuilder& b = c.scene;
  const int floor = b.AddMaterial({{"pbrMetallicRoughness",
                                    {{"baseColorFactor", {0.8, 0.6, 0.7, 1}},
                                     {"metallicFactor", material.metallic},
                                     {"roughnessFactor", material.roughness}}}});
  b.PlaceMesh(b.AddQuad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}, floor));
  if (light == "triangles") {
    b.PlaceMesh(b.AddQuad({-1, 1, -2}, {1, 1, -2}, {1, 2, -1}, {-1, 2, -1},
                          b.AddLambert({0, 0, 0}, {1, 1, 1}, 4)));
  } else if (light == "sphere") {
    b.PlaceMesh(b.AddSphere(0.7, 8, b.AddLambert({0, 0, 0}, {1, 1, 1}, 4), false),
                {0.2, 1.2, -1.4});
  } else if (light == "two_sided") {
    nlohmann::json lamp = {{"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}}},
                           {"emissiveFactor", {1, 1, 1}},
                           {"doubleSided", true}};
    b.PlaceMesh(b.AddQuad({-1, 2, -1}, {1, 2, -1}, {1, 1, -2}, {-1, 1, -2}, b.AddMaterial(lamp)));
  } else {
    c.sky = {8, 4, std::vector<float>(8 * 4 * 3, 0.1f)};
    for (const int x : {3, 4}) c.sky.rgb[3 * (8 + x) + 1] = 6;  // a window towards -z
  }
  b.AddNode({{"camera", 0},
             {"translation", {0, 1, 1.2}},
             {"rotation", {-std::sin(0.35), 0, 0, std::cos(0.35)}}});
  b.json()["cameras"] = {
      {{"type", "perspective"}, {"perspective", {{"yfov", 0.2}, {"znear", 0.01}}}}};
  c.settings = HardSettings(direct == DirectLight::mis ? 256 : 2048, 1);
  c.settings.direct = direct;
  return c;
}

/// Row 10: an object under a transform, as nodes (`times` of them, so that they are instanced or
/// not) or with the transform baked into its vertices.
SceneCase Transformed(const std::string& name, const Point& scale, bool baked, bool instanced) {
  SceneCase c{.name = name + (baked ? "_baked" : instanced ? "_instanced" : "_node")};
  SceneBuilder& b = c.scene;
  const int grey = b.AddLambert({0.7, 0.7, 0.7});
  const int shiny = AddWhite(b, 1, 0.5);
  b.PlaceMesh(b.AddQuad({-4, -1, 4}, {4, -1, 4}, {4, -1, -4}, {-4, -1, -4}, grey));
  std::vector<Point> points;
  std::vector<uint32_t> indices;
  const int n = instanced ? 180 : 24;  // large meshes used twice stay instances
  for (int y = 0; y <= n; ++y) {
    for (int x = 0; x < 2 * n; ++x) {
      const double theta = 3.14159265358979 * y / n, phi = 3.14159265358979 * x / n;
      const double bump = 1 + 0.2 * std::sin(3 * phi) * std::sin(theta);
      points.push_back({bump * std::sin(theta) * std::cos(phi), std::cos(theta),
                        bump * std::sin(theta) * std::sin(phi)});
    }
  }
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < 2 * n; ++x) {
      const auto at = [&](int row, int column) {
        return static_cast<uint32_t>(row * 2 * n + column % (2 * n));
      };
      indices.insert(indices.end(), {at(y, x), at(y, x + 1), at(y + 1, x), at(y, x + 1),
                                     at(y + 1, x + 1), at(y + 1, x)});
    }
  }
  Point size = scale;
  if (baked) {
    for (Point& p : points) {
      for (int i = 0; i < 3; ++i) p[i] *= scale[i];
    }
    if (scale[0] * scale[1] * scale[2] < 0) {
      for (size_t i = 0; i < indices.size(); i += 3) std::swap(indices[i], indices[i + 1]);
    }
    size = {1, 1, 1};
  }
  const int mesh = b.AddMesh(points, indices, shiny);
  for (int i = 0; i < 2; ++i) {
    b.AddNode({{"mesh", mesh}, {"translation", {-0.8 + 1.6 * i, 0, -0.2 * i}}, {"scale", size}});
  }
  b.AddCamera({0, 0.5, 4}, 0.7);
  c.settings = HardSettings(32, 3);
  c.sky = {2, 2, {1, 2, 0.5f, 3, 1, 1, 0.2f, 0.1f, 1, 0.5f, 0.6f, 1}};
  return c;
}

}  // namespace

SceneCase RoomAt(double scale, const Point& offset) {
  SceneCase c{.name = "row46_room"};
  SceneBuilder& b = c.scene;
  const auto at = [&](double x, double y, double z) {
    return nlohmann::json{offset[0] + scale * x, offset[1] + scale * y, offset[2] + scale * z};
  };
  const nlohmann::json size = {scale, scale, scale};
  const int wall = b.AddLambert({0.6, 0.6, 0.6});
  const int lamp = b.AddLambert({0, 0, 0}, {1, 1, 1}, 5);
  const int metal = b.AddMaterial({{"pbrMetallicRoughness",
                                    {{"baseColorFactor", {0.9, 0.7, 0.5, 1}},
                                     {"metallicFactor", 1},
                                     {"roughnessFactor", 0.4}}}});
  b.AddNode({{"mesh", b.AddBox(2, wall, true)}, {"translation", at(0, 0, 0)}, {"scale", size}});
  b.AddNode({{"mesh", b.AddQuad({-0.7, 1.9, -0.7}, {0.7, 1.9, -0.7}, {0.7, 1.9, 0.7},
                                {-0.7, 1.9, 0.7}, lamp)},
             {"translation", at(0, 0, 0)},
             {"scale", size}});
  b.AddNode({{"mesh", b.AddSphere(0.7, 16, metal, false)},
             {"translation", at(0.3, -0.6, 0)},
             {"scale", size}});
  b.AddPunctual({{"type", "point"}, {"intensity", 2 * scale * scale}},
                {{"translation", at(-1, 0.5, 1)}});
  b.json()["cameras"] = {
      {{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"znear", 0.01 * scale}}}}};
  b.AddNode({{"camera", 0}, {"translation", at(0, 0, 1.8)}});
  c.settings = HardSettings(384, 4);
  return c;
}

std::vector<Twins> StrategyTwins() {
  std::vector<Twins> twins;
  for (const char* light : {"triangles", "sphere", "two_sided", "environment"}) {
    for (const Glossy& material : kMaterials) {
      for (const DirectLight direct : {DirectLight::light, DirectLight::bsdf}) {
        twins.push_back({32,
                         Lit(light, material, DirectLight::mis),
                         Lit(light, material, direct),
                         {.precision = 0.01}});
      }
    }
  }
  return twins;
}

std::vector<Twins> TransformTwins() {
  std::vector<Twins> twins;
  const std::pair<const char*, Point> transforms[] = {{"row10_mirrored", {-0.8, 0.8, 0.8}},
                                                      {"row10_stretched", {0.4, 1.2, 0.8}},
                                                      {"row10_turned_over", {-0.5, -1.1, -0.8}},
                                                      {"row10_flat", {0.8, 0, 0.8}}};
  for (const auto& [name, scale] : transforms) {
    for (const bool instanced : {false, true}) {
      SceneCase baked = Transformed(name, scale, true, instanced);
      if (instanced) baked.name += "_fine";
      twins.push_back({10, baked, Transformed(name, scale, false, instanced), {.precision = 0.02}});
    }
  }
  return twins;
}

std::vector<Twins> ScaleTwins() {
  std::vector<Twins> twins;
  const SceneCase one = RoomAt(1, {0, 0, 0});
  const auto add = [&](const char* name, double scale, const Point& offset) {
    SceneCase other = RoomAt(scale, offset);
    other.name = name;
    twins.push_back({46, one, other, {.precision = 0.02}});
  };
  add("row46_room_micro", 1e-6, {0, 0, 0});
  add("row46_room_mega", 1e6, {0, 0, 0});
  add("row46_room_at_1e6", 1, {1e6, 1e6, -1e6});
  add("row46_room_milli_at_1e3", 1e-3, {1e3, 0, 1e3});
  return twins;
}

}  // namespace carpool::test
