// The parts of SceneBuilder that need no template.
#include "tests/render/gltf/scene_builder.h"

#include <unistd.h>

#include <atomic>
#include <fstream>

namespace carpool::render {
namespace {

void AppendWord(std::string& out, uint32_t word) {
  out.append(reinterpret_cast<const char*>(&word), sizeof word);
}

void Pad(std::string& out, char with) {
  out.resize((out.size() + 3) / 4 * 4, with);
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
  static std::atomic<int> counter{0};
  // Memory where there is such a folder: the fuzz tests write thousands of files.
  const std::filesystem::path memory = "/dev/shm";
  const bool writable = access(memory.c_str(), W_OK | X_OK) == 0;
  path_ = (writable ? memory : std::filesystem::temp_directory_path()) /
          ("carpool-gltf-" + std::to_string(getpid()) + "-" + std::to_string(counter++));
  std::filesystem::create_directories(path_);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

void WriteText(const std::filesystem::path& path, std::string_view text) {
  std::ofstream(path, std::ios::binary)
      .write(text.data(), static_cast<std::streamsize>(text.size()));
}

SceneBuilder::SceneBuilder() {
  json = {{"asset", {{"version", "2.0"}}},
          {"scene", 0},
          {"scenes", {{{"nodes", Json::array()}}}},
          {"nodes", Json::array()},
          {"meshes", Json::array()},
          {"accessors", Json::array()},
          {"bufferViews", Json::array()}};
}

size_t SceneBuilder::Components(const std::string& type) {
  if (type == "SCALAR") return 1;
  const size_t n = static_cast<size_t>(type[3] - '0');
  return type[0] == 'V' ? n : n * n;
}

int SceneBuilder::AddView(std::string_view bytes) {
  Pad(binary, '\0');
  json["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}});
  binary += bytes;
  return static_cast<int>(json["bufferViews"].size()) - 1;
}

int SceneBuilder::AddMesh(const Json& primitive) {
  json["meshes"].push_back({{"primitives", Json::array({primitive})}});
  const int mesh = static_cast<int>(json["meshes"].size()) - 1;
  AddNode({{"mesh", mesh}});
  return mesh;
}

int SceneBuilder::AddTriangle() {
  const int positions = AddAccessor<float>("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
  return AddMesh({{"attributes", {{"POSITION", positions}}}});
}

int SceneBuilder::AddQuad() {
  const int positions = AddAccessor<float>("VEC3", {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
  const int normals = AddAccessor<float>("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1});
  const int uvs = AddAccessor<float>("VEC2", {0, 1, 1, 1, 1, 0, 0, 0});
  const int indices = AddAccessor<uint16_t>("SCALAR", {0, 1, 2, 0, 2, 3});
  return AddMesh(
      {{"attributes", {{"POSITION", positions}, {"NORMAL", normals}, {"TEXCOORD_0", uvs}}},
       {"indices", indices}});
}

int SceneBuilder::AddNode(const Json& node, bool in_scene) {
  json["nodes"].push_back(node);
  const int index = static_cast<int>(json["nodes"].size()) - 1;
  if (in_scene) json["scenes"][0]["nodes"].push_back(index);
  return index;
}

Json SceneBuilder::Finished() const {
  Json out = json;
  for (const char* key : {"accessors", "bufferViews", "meshes", "nodes"}) {
    if (out.contains(key) && out[key].empty()) out.erase(key);
  }
  return out;
}

std::string SceneBuilder::Glb() const {
  Json finished = Finished();
  if (!binary.empty() && !finished.contains("buffers")) {
    finished["buffers"] = Json::array({{{"byteLength", binary.size()}}});
  }
  std::string text = finished.dump(), bin = binary;
  Pad(text, ' ');
  Pad(bin, '\0');
  std::string out = "glTF";
  AppendWord(out, 2);
  AppendWord(out, static_cast<uint32_t>(12 + 8 + text.size() + (bin.empty() ? 0 : 8 + bin.size())));
  AppendWord(out, static_cast<uint32_t>(text.size()));
  out += "JSON" + text;
  if (!bin.empty()) {
    AppendWord(out, static_cast<uint32_t>(bin.size()));
    out += std::string("BIN\0", 4) + bin;
  }
  return out;
}

std::string SceneBuilder::Gltf() const {
  Json finished = Finished();
  if (!binary.empty() && !finished.contains("buffers")) {
    finished["buffers"] =
        Json::array({{{"byteLength", binary.size()},
                      {"uri", "data:application/octet-stream;base64," + Base64(binary)}}});
  }
  return finished.dump(1);
}

std::filesystem::path SceneBuilder::WriteGlb(const std::filesystem::path& path) const {
  WriteText(path, Glb());
  return path;
}

std::filesystem::path SceneBuilder::WriteGltf(const std::filesystem::path& path) const {
  WriteText(path, Gltf());
  return path;
}

std::string TinyPng() {
  // Not decoded by the import, so the signature and a name do.
  return std::string("\x89PNG\r\n\x1a\n", 8) + "tiny";
}

std::string Base64(std::string_view bytes) {
  static constexpr char kLetters[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](size_t k) {
      return k < bytes.size() ? static_cast<uint8_t>(bytes[k]) : 0u;
    };
    const uint32_t bits = byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2);
    for (int k = 0; k < 4; ++k) {
      out += i + k > bytes.size() ? '=' : kLetters[bits >> (18 - 6 * k) & 63];
    }
  }
  return out;
}

LoadOptions Collect(std::vector<std::string>& warnings) {
  LoadOptions options;
  options.warn = [&warnings](const std::string& line) { warnings.push_back(line); };
  return options;
}

namespace {

/// One folder for all tests that need only a file; thousands of them would wait for the disk.
const TemporaryFolder& SharedFolder() {
  static const TemporaryFolder folder;
  return folder;
}

}  // namespace

ImportedScene Load(const SceneBuilder& scene, const LoadOptions& options) {
  const TemporaryFolder& folder = SharedFolder();
  return LoadGltf(scene.WriteGlb(folder / "scene.glb"), options);
}

std::string ErrorOf(const std::filesystem::path& path, const LoadOptions& options) {
  try {
    LoadGltf(path, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string ErrorOf(const SceneBuilder& scene, const LoadOptions& options) {
  const TemporaryFolder& folder = SharedFolder();
  return ErrorOf(scene.WriteGlb(folder / "scene.glb"), options);
}

std::vector<float> Stream(const ImportedScene& scene, int shape, int offset, int per_vertex) {
  if (offset == stages::kNone) return {};
  const auto begin = scene.geometry.floats.begin() + offset;
  return {begin, begin + scene.geometry.shapes[shape].vertex_count * per_vertex};
}

namespace {
template <size_t kCount>
std::vector<float> OfVertices(const ImportedScene& scene, int index,
                              float (stages::MeshVertex::*field)[kCount]) {
  const stages::Shape& shape = scene.geometry.shapes[index];
  std::vector<float> values;
  for (int v = 0; v < shape.vertex_count; ++v) {
    const auto& of = scene.geometry.vertices[shape.first_vertex + v].*field;
    values.insert(values.end(), std::begin(of), std::end(of));
  }
  return values;
}
}  // namespace

std::vector<float> Positions(const ImportedScene& scene, int shape) {
  return OfVertices(scene, shape, &stages::MeshVertex::position);
}
std::vector<float> Normals(const ImportedScene& scene, int shape) {
  if (!scene.geometry.shapes[shape].smooth) return {};
  return OfVertices(scene, shape, &stages::MeshVertex::normal);
}
std::vector<float> FirstUvs(const ImportedScene& scene, int shape) {
  if (scene.geometry.shapes[shape].uv_sets == 0) return {};
  return OfVertices(scene, shape, &stages::MeshVertex::uv);
}

}  // namespace carpool::render
