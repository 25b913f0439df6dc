// The scenes that would be too large to store: many instances, many lights, many materials.
#include <cmath>
#include <random>

#include "scenes/png_writer.h"
#include "scenes/scenes.h"

namespace carpool::scenes {
namespace {

Json Painted(const std::array<double, 3>& color, double metallic, double roughness) {
  return {{"pbrMetallicRoughness",
           {{"baseColorFactor", {color[0], color[1], color[2], 1.0}},
            {"metallicFactor", metallic},
            {"roughnessFactor", roughness}}}};
}

/// std::uniform_real_distribution differs between libraries; the same scene everywhere needs this.
class Random {
 public:
  explicit Random(uint32_t seed) : engine_(seed) {}
  double Between(double low, double high) {
    return low + (high - low) * (engine_() / 4294967296.0);
  }

 private:
  std::mt19937 engine_;
};

/// The smallest square grid with at least `count` places.
int GridSide(int count) {
  return static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count))));
}

void AddPlain(GltfWriter& scene, float half) {
  TriangleMesh plain;
  plain.AddQuad({-half, 0, half}, {half, 0, half}, {half, 0, -half}, {-half, 0, -half});
  const int mesh = scene.AddMesh(scene.AddShape(plain),
                                 scene.AddMaterial(Painted({0.5, 0.5, 0.5}, 0, 0.8)), "plain");
  scene.AddNode({{"name", "plain"}, {"mesh", mesh}});
}

void AddSky(GltfWriter& scene, float half, float height, double strength) {
  TriangleMesh sky;
  sky.AddQuad({-half, height, -half}, {half, height, -half}, {half, height, half},
              {-half, height, half});
  Json material = Painted({0, 0, 0}, 0, 1);
  material["emissiveFactor"] = {1, 1, 1};
  material["extensions"]["KHR_materials_emissive_strength"] = {{"emissiveStrength", strength}};
  scene.AddNode({{"name", "sky"},
                 {"mesh", scene.AddMesh(scene.AddShape(sky), scene.AddMaterial(material), "sky")}});
}

/// One picture of stripes and checks that differs by `seed`.
std::string MakePicture(uint32_t seed) {
  constexpr int kSize = 256;
  Random random(seed);
  std::array<double, 3> colors[2];
  for (auto& color : colors) {
    for (double& channel : color) channel = random.Between(30, 255);
  }
  const int columns = 2 + static_cast<int>(random.Between(0, 14)),
            rows = 2 + static_cast<int>(random.Between(0, 14));
  std::vector<uint8_t> rgb;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const auto& color = colors[(x * columns / kSize + y * rows / kSize) % 2];
      for (double channel : color) rgb.push_back(static_cast<uint8_t>(channel));
    }
  }
  return EncodePng(kSize, kSize, rgb);
}

}  // namespace

GltfWriter Instances(int count) {
  constexpr int kMaterials = 8;
  GltfWriter scene;
  Random random(1);
  TriangleMesh ball = MakeBall(60, 61);  // 7,200 triangles
  ball.uvs.clear();
  const int shape = scene.AddShape(ball);
  std::vector<int> meshes;
  for (int k = 0; k < kMaterials; ++k) {
    const std::array<double, 3> color = {random.Between(0.2, 0.9), random.Between(0.2, 0.9),
                                         random.Between(0.2, 0.9)};
    meshes.push_back(
        scene.AddMesh(shape, scene.AddMaterial(Painted(color, k % 2, 0.1 + 0.1 * k)), "ball"));
  }
  const int side = GridSide(count);
  for (int i = 0; i < count; ++i) {
    const double size = random.Between(0.2, 0.5), x = i % side - side / 2.0,
                 z = i / side - side / 2.0;
    scene.AddNode({{"mesh", meshes[i % kMaterials]},
                   {"translation", {x, size, z}},
                   {"scale", {size, size, size}}});
  }
  AddPlain(scene, static_cast<float>(side));
  AddSky(scene, static_cast<float>(side), static_cast<float>(side), 2);
  scene.AddCamera("camera", {0, side * 0.35, side * 0.8}, {0, 0, 0}, 0.8);
  return scene;
}

// A town at night, seen from above: lamps shine down, so that an image's noise is that of what they
// light, not of the lamps themselves, which would be smaller than pixels.
GltfWriter Lights(int count) {
  constexpr int kStrengths = 13;  // half decades from 1e-3 to 1e3
  constexpr double kHalf = 100, kBlock = 8, kHouse = 4;
  GltfWriter scene;
  Random random(2);
  const auto in_house = [](double x) { return x - kBlock * std::floor(x / kBlock) < kHouse; };
  std::vector<TriangleMesh> groups(kStrengths);
  for (int i = 0; i < count; ++i) {
    double x, z;
    do {
      x = random.Between(-kHalf, kHalf);
      z = random.Between(-kHalf, kHalf);
    } while (in_house(x) && in_house(z));
    TriangleMesh& group = groups[i % kStrengths];
    const double y = random.Between(1.5, 2.5);
    for (const auto& [dx, dz] :
         {std::pair{-0.05, -0.05}, std::pair{0.05, -0.05}, std::pair{0.0, 0.05}}) {
      group.indices.push_back(static_cast<uint32_t>(group.positions.size()));
      group.positions.push_back(
          {static_cast<float>(x + dx), static_cast<float>(y), static_cast<float>(z + dz)});
    }
  }
  for (int k = 0; k < kStrengths; ++k) {
    if (groups[k].positions.empty()) continue;
    Json material = Painted({0, 0, 0}, 0, 1);
    material["emissiveFactor"] = {random.Between(0.3, 1), random.Between(0.3, 1),
                                  random.Between(0.3, 1)};
    material["extensions"]["KHR_materials_emissive_strength"] = {
        {"emissiveStrength", std::pow(10, -3 + 0.5 * k)}};
    scene.AddNode(
        {{"mesh", scene.AddMesh(scene.AddShape(groups[k]), scene.AddMaterial(material), "lamps")}});
  }
  AddPlain(scene, static_cast<float>(kHalf));
  const int house = scene.AddMesh(scene.AddShape(MakeBox({0, 0, 0}, {1, 1, 1})),
                                  scene.AddMaterial(Painted({0.6, 0.55, 0.5}, 0, 0.8)), "house");
  const double first = -kBlock * std::floor(kHalf / kBlock);
  for (double x = first; x < kHalf; x += kBlock) {
    for (double z = first; z < kHalf; z += kBlock) {
      scene.AddNode({{"mesh", house},
                     {"translation", {x, 0, z}},
                     {"scale", {kHouse, random.Between(2, 8), kHouse}}});
    }
  }
  scene.AddCamera("camera", {0, 30, 45}, {0, 0, 0}, 0.8);
  return scene;
}

GltfWriter Textures(int count) {
  GltfWriter scene;
  const int shape = scene.AddShape(MakeBall(48, 24));
  const int side = GridSide(count);
  for (int i = 0; i < count; ++i) {
    Json material = Painted({1, 1, 1}, i % 3 == 0, 0.05 + 0.9 * i / count);
    material["pbrMetallicRoughness"]["baseColorTexture"] = {
        {"index", scene.AddTexture(MakePicture(static_cast<uint32_t>(i)))}};
    const double x = i % side - side / 2.0, z = i / side - side / 2.0;
    scene.AddNode({{"mesh", scene.AddMesh(shape, scene.AddMaterial(material), "ball")},
                   {"translation", {x, 0.45, z}},
                   {"scale", {0.45, 0.45, 0.45}}});
  }
  AddPlain(scene, static_cast<float>(side));
  AddSky(scene, static_cast<float>(side), static_cast<float>(side), 2);
  scene.AddCamera("camera", {0, side * 0.8, side * 1.0}, {0, 0, 0}, 0.8);
  return scene;
}

}  // namespace carpool::scenes
