// The scenes that are stored as text: Cornell box, furnace, materials.
#include <cmath>

#include "scenes/scenes.h"

namespace carpool::scenes {
namespace {

/// A material without any specular part, so that closed forms for Lambertian surfaces hold.
Json Matte(const std::string& name, const std::array<double, 3>& color) {
  return {{"name", name},
          {"pbrMetallicRoughness",
           {{"baseColorFactor", {color[0], color[1], color[2], 1.0}},
            {"metallicFactor", 0.0},
            {"roughnessFactor", 1.0}}},
          {"extensions", {{"KHR_materials_specular", {{"specularFactor", 0.0}}}}}};
}

Json Emitting(Json material, const std::array<double, 3>& factor, double strength) {
  material["emissiveFactor"] = factor;
  if (strength != 1)
    material["extensions"]["KHR_materials_emissive_strength"] = {{"emissiveStrength", strength}};
  return material;
}

Json Reflecting(const std::string& name, const std::array<double, 3>& color, double metallic,
                double roughness) {
  return {{"name", name},
          {"pbrMetallicRoughness",
           {{"baseColorFactor", {color[0], color[1], color[2], 1.0}},
            {"metallicFactor", metallic},
            {"roughnessFactor", roughness}}}};
}

void AddObject(GltfWriter& scene, const std::string& name, const TriangleMesh& mesh, int material) {
  scene.AddNode({{"name", name}, {"mesh", scene.AddMesh(scene.AddShape(mesh), material, name)}});
}

/// Cornell University's measurements are in millimetres with x to the left and z into the room;
/// here the room is two units wide, stands on y = 0 and is looked into along -z.
Point FromCornell(double x, double y, double z) {
  constexpr double kScale = 277.0;
  return {static_cast<float>((277.0 - x) / kScale), static_cast<float>(y / kScale),
          static_cast<float>((277.0 - z) / kScale)};
}

/// An upright block over four corners on the floor, counter-clockwise seen from above.
TriangleMesh Block(const double (&corners)[4][2], double height) {
  TriangleMesh block;
  const auto at = [&](int i, double y) {
    return FromCornell(corners[i % 4][0], y, corners[i % 4][1]);
  };
  block.AddQuad(at(0, height), at(1, height), at(2, height), at(3, height));
  for (int i = 0; i < 4; ++i)
    block.AddQuad(at(i, 0), at(i + 1, 0), at(i + 1, height), at(i, height));
  return block;
}

TriangleMesh Square(const Point& a, const Point& b, const Point& c, const Point& d) {
  TriangleMesh square;
  square.AddQuad(a, b, c, d);
  return square;
}

constexpr double kRoom = 554;

void AddCornellWalls(GltfWriter& scene, int white, int red, int green) {
  const auto p = FromCornell;
  AddObject(scene, "floor", Square(p(kRoom, 0, 0), p(0, 0, 0), p(0, 0, kRoom), p(kRoom, 0, kRoom)),
            white);
  AddObject(scene, "ceiling",
            Square(p(kRoom, kRoom, 0), p(kRoom, kRoom, kRoom), p(0, kRoom, kRoom), p(0, kRoom, 0)),
            white);
  AddObject(scene, "back wall",
            Square(p(kRoom, 0, kRoom), p(0, 0, kRoom), p(0, kRoom, kRoom), p(kRoom, kRoom, kRoom)),
            white);
  AddObject(scene, "right wall",
            Square(p(0, 0, kRoom), p(0, 0, 0), p(0, kRoom, 0), p(0, kRoom, kRoom)), green);
  AddObject(scene, "left wall",
            Square(p(kRoom, 0, 0), p(kRoom, 0, kRoom), p(kRoom, kRoom, kRoom), p(kRoom, kRoom, 0)),
            red);
}

/// A floor that bends up into a wall behind, facing the viewer, with smooth normals.
TriangleMesh Backdrop(float half_width, float front, float back, float radius, float height) {
  constexpr int kBend = 24;
  TriangleMesh mesh;
  const auto add_row = [&](float y, float z, float normal_y, float normal_z) {
    for (float x : {-half_width, half_width}) {
      mesh.positions.push_back({x, y, z});
      mesh.normals.push_back({0, normal_y, normal_z});
    }
  };
  add_row(0, front, 1, 0);
  for (int i = 0; i <= kBend; ++i) {
    const double angle = 1.57079632679489662 * i / kBend;
    const auto s = static_cast<float>(std::sin(angle)), c = static_cast<float>(std::cos(angle));
    add_row(radius * (1 - c), back + radius * (1 - s), c, s);
  }
  add_row(height, back, 0, 1);
  for (uint32_t row = 0; row + 4 <= mesh.positions.size(); row += 2) {
    mesh.indices.insert(mesh.indices.end(), {row, row + 1, row + 3, row, row + 3, row + 2});
  }
  return mesh;
}

/// A lamp: a square of a given size at `height` above (x, z) that shines down.
TriangleMesh Lamp(float x, float z, float height, float half_width, float half_depth) {
  return Square({x - half_width, height, z - half_depth}, {x + half_width, height, z - half_depth},
                {x + half_width, height, z + half_depth}, {x - half_width, height, z + half_depth});
}

struct Paint {
  const char* name;
  std::array<double, 3> color;
  double metallic;
};

}  // namespace

GltfWriter CornellBox() {
  GltfWriter scene;
  const int white = scene.AddMaterial(Matte("white", {0.73, 0.73, 0.73}));
  const int red = scene.AddMaterial(Matte("red", {0.61, 0.057, 0.048}));
  const int green = scene.AddMaterial(Matte("green", {0.12, 0.43, 0.11}));
  const int lamp =
      scene.AddMaterial(Emitting(Matte("lamp", {0.78, 0.78, 0.78}), {1, 0.81, 0.55}, 40));
  AddCornellWalls(scene, white, red, green);
  const double short_block[4][2] = {{130, 65}, {82, 225}, {240, 272}, {290, 114}};
  const double tall_block[4][2] = {{423, 247}, {265, 296}, {314, 456}, {472, 406}};
  AddObject(scene, "short block", Block(short_block, 165), white);
  AddObject(scene, "tall block", Block(tall_block, 330), white);
  const auto p = FromCornell;
  constexpr double kBelow = 553.5;  // a little under the ceiling
  AddObject(
      scene, "lamp",
      Square(p(343, kBelow, 227), p(343, kBelow, 332), p(213, kBelow, 332), p(213, kBelow, 227)),
      lamp);
  scene.AddCamera("camera", {0, 1, 3.89}, {0, 1, 0}, 0.686);
  return scene;
}

GltfWriter Furnace() {
  GltfWriter scene;
  const int glow = scene.AddMaterial(Emitting(Matte("glow", {0.5, 0.5, 0.5}), {0.5, 0.5, 0.5}, 1));
  AddObject(scene, "room", Reversed(MakeBox({-2, -2, -2}, {2, 2, 2})), glow);
  TriangleMesh ball = MakeBall(24, 12);
  ball.normals.clear();  // flat, so that no shading normal spends energy at the rim
  ball.uvs.clear();
  AddObject(scene, "ball", ball, glow);
  scene.AddCamera("camera", {0, 0.5, 1.9}, {0, 0, 0}, 1.2);
  return scene;
}

GltfWriter Materials() {
  constexpr int kColumns = 7;
  const Paint paints[] = {{"gold", {1.0, 0.71, 0.29}, 1},
                          {"copper", {0.93, 0.56, 0.44}, 1},
                          {"blue", {0.03, 0.14, 0.52}, 0},
                          {"white", {0.8, 0.8, 0.8}, 0}};
  GltfWriter scene;
  TriangleMesh ball = MakeBall(96, 48);
  ball.uvs.clear();
  const int shape = scene.AddShape(ball);
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const double roughness = std::round(1000 * (0.03 + 0.97 * column / (kColumns - 1))) / 1000;
      const std::string name = paints[row].name + std::string(" ") + std::to_string(column);
      const int material =
          scene.AddMaterial(Reflecting(name, paints[row].color, paints[row].metallic, roughness));
      scene.AddNode({{"name", name},
                     {"mesh", scene.AddMesh(shape, material, name)},
                     {"translation", {column - 3.0, 0.45, 1.1 - 1.1 * row}},
                     {"scale", {0.45, 0.45, 0.45}}});
    }
  }
  const int ground = scene.AddMaterial(Reflecting("ground", {0.3, 0.285, 0.27}, 0, 0.4));
  AddObject(scene, "backdrop", Backdrop(14, 12, -6, 3, 11), ground);
  // Black panels that only glow: large and dim ones, so that mirrors have something to reflect, and
  // a small bright one for shadows and highlights.
  const Json panel = Matte("panel", {0, 0, 0});
  const int key = scene.AddMaterial(Emitting(panel, {1, 0.85, 0.68}, 20));
  const int soft = scene.AddMaterial(Emitting(panel, {0.8, 0.9, 1}, 1.2));
  const int warm = scene.AddMaterial(Emitting(panel, {1, 0.55, 0.3}, 1.8));
  AddObject(scene, "key lamp", Lamp(-3, 2.5f, 5, 1, 1), key);
  AddObject(scene, "soft box", Lamp(0, -1, 8.5f, 7, 5), soft);
  AddObject(scene, "right panel", Square({9, 0.2f, -6}, {9, 0.2f, 6}, {9, 6, 6}, {9, 6, -6}), soft);
  AddObject(scene, "left panel", Square({-9, 0.2f, 5}, {-9, 0.2f, -6}, {-9, 5, -6}, {-9, 5, 5}),
            warm);
  AddObject(scene, "front panel", Square({-7, 1, 11}, {-7, 7, 11}, {7, 7, 11}, {7, 1, 11}), soft);
  scene.AddCamera("camera", {0, 4.4, 8}, {0, 0.25, -0.5}, 0.53);
  return scene;
}

}  // namespace carpool::scenes
