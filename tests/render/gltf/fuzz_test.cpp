// Mutated files: whatever the bytes, the import succeeds or throws InputError; nothing else.
#include <gtest/gtest.h>

#include <random>

#include "tests/render/gltf/scene_builder.h"

namespace carpool::render {
namespace {

/// A scene with something of everything, so that mutations reach all readers.
SceneBuilder Rich() {
  SceneBuilder scene;
  scene.AddQuad();
  scene.AddTriangle();
  Json& quad = scene.json["meshes"][0]["primitives"][0];
  quad["material"] = 0;
  quad["attributes"]["COLOR_0"] =
      scene.AddAccessor<uint8_t>("VEC4", std::vector<uint8_t>(16, 200), true);
  quad["targets"] = {{{"POSITION", 0}, {"NORMAL", 1}}};
  scene.json["meshes"][0]["weights"] = {0.5};
  Json& triangle = scene.json["meshes"][1]["primitives"][0];
  triangle["attributes"]["JOINTS_0"] =
      scene.AddAccessor<uint8_t>("VEC4", std::vector<uint8_t>(12, 0));
  triangle["attributes"]["WEIGHTS_0"] =
      scene.AddAccessor<float>("VEC4", std::vector<float>(12, 0.25f));
  scene.json["skins"] = {{{"joints", {2}}}};
  scene.json["nodes"][1]["skin"] = 0;
  scene.AddNode({{"rotation", {0, 0, 0.6, 0.8}}, {"children", {3}}});
  scene.AddNode(
      {{"mesh", 0},
       {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", 0}}}}}}}},
      false);
  scene.AddNode({{"camera", 0}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  scene.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 1}}}}};
  scene.json["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "spot"}, {"spot", {{"outerConeAngle", 1}}}}};
  const std::string sparse_indices("\x00\x02", 2);
  scene.json["accessors"][0]["sparse"] = {
      {"count", 2},
      {"indices", {{"bufferView", scene.AddView(sparse_indices)}, {"componentType", 5121}}},
      {"values", {{"bufferView", scene.AddView(std::string(24, '\0'))}}}};
  scene.json["images"] = {{{"bufferView", scene.AddView(TinyPng())}, {"mimeType", "image/png"}},
                          {{"uri", "data:image/png;base64," + Base64(TinyPng())}}};
  scene.json["samplers"] = {{{"wrapS", 33071}, {"minFilter", 9984}}};
  scene.json["textures"] = {{{"source", 0}, {"sampler", 0}}, {{"source", 1}}};
  scene.json["materials"] = {
      {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}},
       {"normalTexture",
        {{"index", 1}, {"extensions", {{"KHR_texture_transform", {{"scale", {2, 2}}}}}}}},
       {"extensions", {{"KHR_materials_ior", {{"ior", 1.4}}}}}}};
  return scene;
}

class Mutator {
 public:
  explicit Mutator(uint32_t seed) : random_(seed) {}

  /// One to eight faults: a flipped bit, a byte from a list of troublesome ones, a run of digits, a
  /// copied or removed stretch, a cut.
  std::string Mutate(std::string bytes) {
    for (uint32_t n = 1 + Below(8); n > 0 && !bytes.empty(); --n) MutateOnce(bytes);
    return bytes;
  }

 private:
  uint32_t Below(size_t limit) { return static_cast<uint32_t>(random_() % limit); }

  void MutateOnce(std::string& bytes) {
    static constexpr char kTrouble[] = "0123456789-.eE\"[]{},:\\/%\0\x7f\xff";
    const uint32_t at = Below(bytes.size());
    switch (Below(8)) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << Below(8)));
        return;
      case 1:
        bytes.resize(at);
        return;
      case 2:
        bytes.erase(at, 1 + Below(16));
        return;
      case 3:
        bytes.insert(at, bytes.substr(Below(bytes.size()), 1 + Below(64)));
        return;
      case 4:
        bytes.insert(at, std::to_string(random_()));
        return;
      case 5:
        bytes[at] = static_cast<char>(random_());
        return;
      default:
        bytes[at] = kTrouble[Below(sizeof kTrouble - 1)];
        return;
    }
  }

  std::mt19937 random_;
};

/// How many of `count` mutations of `good` still load. Limits are small, so that nothing large is
/// tried.
int Survivors(const std::string& good, const std::string& name, int count, uint32_t seed) {
  const TemporaryFolder folder;
  LoadOptions options;
  options.max_geometry_bytes = 64 << 20;
  options.warn = [](const std::string& line) { EXPECT_EQ(line.find('\n'), std::string::npos); };
  Mutator mutator(seed);
  int survivors = 0;
  for (int i = 0; i < count; ++i) {
    const std::string bytes = mutator.Mutate(good);
    WriteText(folder / name, bytes);
    try {
      LoadGltf(folder / name, options);
      ++survivors;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    } catch (const std::exception& error) {
      ADD_FAILURE() << "mutation " << i << " of " << name << " (seed " << seed
                    << "): " << error.what();
      WriteText(std::filesystem::temp_directory_path() / ("failed-" + name), bytes);
    }
  }
  return survivors;
}

TEST(Fuzz, TheSceneItselfLoads) {
  const TemporaryFolder folder;
  EXPECT_EQ(ErrorOf(Rich().WriteGlb(folder / "a.glb")), "");
  EXPECT_EQ(ErrorOf(Rich().WriteGltf(folder / "a.gltf")), "");
}

TEST(Fuzz, Glb) {
  // Some must get through, or the mutations are too rough to reach the readers behind the parser.
  EXPECT_GT(Survivors(Rich().Glb(), "scene.glb", 6000, 1), 100);
}

TEST(Fuzz, Gltf) {
  EXPECT_GT(Survivors(Rich().Gltf(), "scene.gltf", 6000, 2), 100);
}

/// Mutations of values only: the JSON stays valid, so that every case reaches the schema and
/// beyond.
TEST(Fuzz, NumbersInValidJson) {
  std::mt19937 random(3);
  const Json flat = Rich().json.flatten();
  std::vector<std::string> numbers;
  for (const auto& [key, value] : flat.items()) {
    if (value.is_number()) numbers.push_back(key);
  }
  int survivors = 0;
  for (int i = 0; i < 3000; ++i) {
    SceneBuilder scene = Rich();
    for (uint32_t n = 1 + random() % 4; n > 0; --n) {
      Json& value = scene.json[Json::json_pointer(numbers[random() % numbers.size()])];
      static constexpr double kValues[] = {-1, 0,   1,     2,   3,    4,    5,    7,    8,
                                           16, 255, 65536, 1e9, 1e20, 5121, 5123, 5126, 0.5};
      value = kValues[random() % std::size(kValues)];
    }
    LoadOptions options;
    options.max_geometry_bytes = 64 << 20;
    EXPECT_NO_THROW(survivors += ErrorOf(scene, options).empty()) << scene.json.dump();
  }
  EXPECT_GT(survivors, 100);
}

}  // namespace
}  // namespace carpool::render
