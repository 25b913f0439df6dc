// glTF output: accessors, embedded data, and the two file formats.
#include "scenes/gltf_writer.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

namespace carpool::scenes {
namespace {

constexpr int kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126;

template <typename T>
std::string_view BytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

void Pad(std::string& bytes, char with) {
  bytes.resize((bytes.size() + 3) / 4 * 4, with);
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
    for (int k = 0; k < 4; ++k)
      out += i + k > bytes.size() ? '=' : kLetters[bits >> (18 - 6 * k) & 63];
  }
  return out;
}

void AppendWord(std::string& out, size_t word) {
  if (word > std::numeric_limits<uint32_t>::max())
    throw std::runtime_error("the scene is too large for a .glb");
  for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(word >> shift);
}

std::string MakeGlb(std::string text, std::string binary) {
  Pad(text, ' ');
  Pad(binary, '\0');
  std::string out = "glTF";
  AppendWord(out, 2);
  AppendWord(out, 12 + 8 + text.size() + 8 + binary.size());
  AppendWord(out, text.size());
  out += "JSON" + text;
  AppendWord(out, binary.size());
  return out + std::string("BIN\0", 4) + binary;
}

/// A rotation that turns -z into `direction`, as a node matrix at `from`.
Json LookAt(const std::array<double, 3>& from, const std::array<double, 3>& to) {
  std::array<double, 3> z;
  double length = 0;
  for (int i = 0; i < 3; ++i) length += (from[i] - to[i]) * (from[i] - to[i]);
  for (int i = 0; i < 3; ++i) z[i] = (from[i] - to[i]) / std::sqrt(length);
  const double flat = std::hypot(z[0], z[2]);
  const std::array<double, 3> x = {z[2] / flat, 0, -z[0] / flat};
  const std::array<double, 3> y = {z[1] * x[2], z[2] * x[0] - z[0] * x[2], -z[1] * x[0]};
  return {x[0], x[1], x[2], 0, y[0],    y[1],    y[2],    0,
          z[0], z[1], z[2], 0, from[0], from[1], from[2], 1};
}

}  // namespace

GltfWriter::GltfWriter() {
  json_ = {{"asset", {{"version", "2.0"}, {"generator", "generate-scenes"}}}, {"scene", 0}};
  json_["scenes"] = Json::array({{{"nodes", Json::array()}}});
}

int GltfWriter::AddView(std::string_view bytes) {
  Pad(binary_, '\0');
  json_["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}});
  binary_ += bytes;
  return static_cast<int>(json_["bufferViews"].size()) - 1;
}

int GltfWriter::AddAccessor(std::string_view bytes, int component_type, size_t count,
                            const char* type) {
  const int view = AddView(bytes);
  json_["accessors"].push_back(
      {{"bufferView", view}, {"componentType", component_type}, {"count", count}, {"type", type}});
  return static_cast<int>(json_["accessors"].size()) - 1;
}

int GltfWriter::AddShape(const TriangleMesh& mesh) {
  const size_t count = mesh.positions.size();
  Json shape;
  const int positions = AddAccessor(BytesOf(mesh.positions), kFloat, count, "VEC3");
  Point low = mesh.positions.front(), high = low;
  for (const Point& p : mesh.positions) {
    for (int i = 0; i < 3; ++i) low[i] = std::min(low[i], p[i]), high[i] = std::max(high[i], p[i]);
  }
  json_["accessors"][positions]["min"] = low;
  json_["accessors"][positions]["max"] = high;
  shape["attributes"]["POSITION"] = positions;
  if (!mesh.normals.empty()) {
    // A ball's normals are its positions, which need not be stored twice.
    shape["attributes"]["NORMAL"] = mesh.normals == mesh.positions
                                        ? positions
                                        : AddAccessor(BytesOf(mesh.normals), kFloat, count, "VEC3");
  }
  if (!mesh.uvs.empty())
    shape["attributes"]["TEXCOORD_0"] = AddAccessor(BytesOf(mesh.uvs), kFloat, count, "VEC2");
  if (count < 65535) {
    const std::vector<uint16_t> shorts(mesh.indices.begin(), mesh.indices.end());
    shape["indices"] = AddAccessor(BytesOf(shorts), kUnsignedShort, shorts.size(), "SCALAR");
  } else {
    shape["indices"] =
        AddAccessor(BytesOf(mesh.indices), kUnsignedInt, mesh.indices.size(), "SCALAR");
  }
  shapes_.push_back(shape);
  return static_cast<int>(shapes_.size()) - 1;
}

int GltfWriter::AddMesh(int shape, int material, const std::string& name) {
  Json primitive = shapes_[shape];
  primitive["material"] = material;
  json_["meshes"].push_back({{"name", name}, {"primitives", Json::array({primitive})}});
  return static_cast<int>(json_["meshes"].size()) - 1;
}

int GltfWriter::AddMaterial(const Json& material) {
  if (material.contains("extensions")) {
    for (const auto& [name, unused] : material["extensions"].items()) {
      Json& used = json_["extensionsUsed"];
      if (std::find(used.begin(), used.end(), name) == used.end()) used.push_back(name);
    }
  }
  json_["materials"].push_back(material);
  return static_cast<int>(json_["materials"].size()) - 1;
}

int GltfWriter::AddTexture(const std::string& png) {
  const int view = AddView(png);
  json_["images"].push_back({{"bufferView", view}, {"mimeType", "image/png"}});
  json_["textures"].push_back({{"source", json_["images"].size() - 1}});
  return static_cast<int>(json_["textures"].size()) - 1;
}

int GltfWriter::AddNode(const Json& node) {
  json_["nodes"].push_back(node);
  const int index = static_cast<int>(json_["nodes"].size()) - 1;
  json_["scenes"][0]["nodes"].push_back(index);
  return index;
}

void GltfWriter::AddCamera(const std::string& name, const std::array<double, 3>& from,
                           const std::array<double, 3>& to, double yfov) {
  json_["cameras"].push_back(
      {{"type", "perspective"}, {"perspective", {{"yfov", yfov}, {"znear", 0.01}}}});
  AddNode({{"name", name}, {"camera", json_["cameras"].size() - 1}, {"matrix", LookAt(from, to)}});
}

void GltfWriter::Write(const std::filesystem::path& path) const {
  Json out = json_;
  const bool glb = path.extension() == ".glb";
  Json buffer = {{"byteLength", binary_.size()}};
  if (!glb) buffer["uri"] = "data:application/octet-stream;base64," + Base64(binary_);
  out["buffers"] = Json::array({buffer});
  std::ofstream stream(path, std::ios::binary);
  stream << (glb ? MakeGlb(out.dump(), binary_) : out.dump(1) + "\n");
  stream.close();
  if (!stream) throw std::runtime_error("cannot write '" + path.string() + "'");
}

}  // namespace carpool::scenes
