// glTF text with base64 buffers.
#include "tests/support/scene_builder.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "scenes/png_writer.h"

namespace carpool::test {
namespace {

std::string Base64(const std::vector<unsigned char>& bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t left = std::min<size_t>(3, bytes.size() - i);
    uint32_t word = 0;
    for (size_t k = 0; k < 3; ++k) word = word << 8 | (k < left ? bytes[i + k] : 0u);
    for (size_t k = 0; k < 4; ++k) text += k <= left ? kDigits[(word >> (18 - 6 * k)) & 63] : '=';
  }
  return text;
}

}  // namespace

SceneBuilder::SceneBuilder() {
  json_ = {{"asset", {{"version", "2.0"}}},
           {"scene", 0},
           {"scenes", {{{"nodes", nlohmann::json::array()}}}},
           {"nodes", nlohmann::json::array()},
           {"meshes", nlohmann::json::array()},
           {"materials", nlohmann::json::array()},
           {"accessors", nlohmann::json::array()},
           {"bufferViews", nlohmann::json::array()}};
}

void SceneBuilder::DeclareExtension(const std::string& name) {
  nlohmann::json& used = json_["extensionsUsed"];
  if (used.is_null() || std::find(used.begin(), used.end(), name) == used.end())
    used.push_back(name);
}

int SceneBuilder::AddMaterial(const nlohmann::json& material) {
  if (material.contains("extensions")) {
    for (const auto& [name, value] : material["extensions"].items()) DeclareExtension(name);
  }
  json_["materials"].push_back(material);
  return static_cast<int>(json_["materials"].size()) - 1;
}

int SceneBuilder::AddLambert(const Point& albedo, const Point& emission, double strength) {
  nlohmann::json material = {{"pbrMetallicRoughness",
                              {{"baseColorFactor", {albedo[0], albedo[1], albedo[2], 1}},
                               {"metallicFactor", 0},
                               {"roughnessFactor", 1}}},
                             {"emissiveFactor", emission},
                             {"extensions", {{"KHR_materials_specular", {{"specularFactor", 0}}}}}};
  if (strength != 1)
    material["extensions"]["KHR_materials_emissive_strength"] = {{"emissiveStrength", strength}};
  return AddMaterial(material);
}

int SceneBuilder::AddView(const void* data, size_t bytes) {
  const size_t offset = buffer_.size();
  const auto* const first = static_cast<const unsigned char*>(data);
  buffer_.insert(buffer_.end(), first, first + bytes);
  json_["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", bytes}});
  return static_cast<int>(json_["bufferViews"].size()) - 1;
}

int SceneBuilder::AddAccessor(const std::vector<float>& values, int components) {
  nlohmann::json accessor = {{"bufferView", AddView(values.data(), values.size() * 4)},
                             {"componentType", 5126},
                             {"count", values.size() / components},
                             {"type", "VEC" + std::to_string(components)}};
  if (components == 3) {
    nlohmann::json low, high;
    for (size_t c = 0; c < 3; ++c) {
      float least = values[c], most = values[c];
      for (size_t i = c; i < values.size(); i += 3) {
        least = std::min(least, values[i]);
        most = std::max(most, values[i]);
      }
      low.push_back(least);
      high.push_back(most);
    }
    accessor["min"] = low;
    accessor["max"] = high;
  }
  json_["accessors"].push_back(accessor);
  return static_cast<int>(json_["accessors"].size()) - 1;
}

int SceneBuilder::AddIndices(const std::vector<uint32_t>& indices) {
  json_["accessors"].push_back({{"bufferView", AddView(indices.data(), indices.size() * 4)},
                                {"componentType", 5125},
                                {"count", indices.size()},
                                {"type", "SCALAR"}});
  return static_cast<int>(json_["accessors"].size()) - 1;
}

int SceneBuilder::AddTexture(int width, int height, const std::vector<uint8_t>& rgb,
                             const nlohmann::json& sampler) {
  const std::string png = scenes::EncodePng(width, height, rgb);
  json_["images"].push_back({{"uri", "data:image/png;base64," + Base64({png.begin(), png.end()})}});
  json_["samplers"].push_back(sampler);
  json_["textures"].push_back(
      {{"source", json_["images"].size() - 1}, {"sampler", json_["samplers"].size() - 1}});
  return static_cast<int>(json_["textures"].size()) - 1;
}

int SceneBuilder::AddMesh(const std::vector<Point>& positions, const std::vector<uint32_t>& indices,
                          int material, const std::vector<std::array<double, 2>>& uvs,
                          const std::vector<Point>& normals) {
  const auto flatten = [](const std::vector<Point>& points) {
    std::vector<float> floats;
    for (const Point& p : points)
      floats.insert(floats.end(),
                    {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
    return floats;
  };
  std::vector<float> uv;
  for (const auto& t : uvs)
    uv.insert(uv.end(), {static_cast<float>(t[0]), static_cast<float>(t[1])});
  nlohmann::json primitive = {{"attributes", {{"POSITION", AddAccessor(flatten(positions), 3)}}},
                              {"indices", AddIndices(indices)},
                              {"material", material}};
  if (!uv.empty()) primitive["attributes"]["TEXCOORD_0"] = AddAccessor(uv, 2);
  if (!normals.empty()) primitive["attributes"]["NORMAL"] = AddAccessor(flatten(normals), 3);
  json_["meshes"].push_back({{"primitives", {primitive}}});
  return static_cast<int>(json_["meshes"].size()) - 1;
}

int SceneBuilder::AddQuad(const Point& a, const Point& b, const Point& c, const Point& d,
                          int material) {
  return AddMesh({a, b, c, d}, {0, 1, 2, 0, 2, 3}, material, {{0, 1}, {1, 1}, {1, 0}, {0, 0}});
}

int SceneBuilder::AddBox(double half, int material, bool inwards) {
  std::vector<Point> points;
  std::vector<uint32_t> indices;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      const auto first = static_cast<uint32_t>(points.size());
      for (const auto& [s, t] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
        Point p;
        p[axis] = side * half;
        p[(axis + 1) % 3] = s * half;
        p[(axis + 2) % 3] = t * half;
        points.push_back(p);
      }
      const bool flip = (side < 0) != inwards;  // counter-clockwise from +axis otherwise
      for (const uint32_t k :
           flip ? std::array{0u, 2u, 1u, 0u, 3u, 2u} : std::array{0u, 1u, 2u, 0u, 2u, 3u}) {
        indices.push_back(first + k);
      }
    }
  }
  return AddMesh(points, indices, material);
}

int SceneBuilder::AddSphere(double radius, int rings, int material, bool inwards, bool smooth) {
  constexpr double kPi = 3.14159265358979323846;
  const int segments = 2 * rings;
  std::vector<Point> points, normals;
  std::vector<uint32_t> indices;
  for (int r = 0; r <= rings; ++r) {
    for (int s = 0; s < segments; ++s) {
      const double theta = kPi * r / rings, phi = 2 * kPi * s / segments;
      const Point p = {std::sin(theta) * std::cos(phi), std::cos(theta),
                       -std::sin(theta) * std::sin(phi)};
      points.push_back({radius * p[0], radius * p[1], radius * p[2]});
      const double side = inwards ? -1 : 1;
      if (smooth) normals.push_back({side * p[0], side * p[1], side * p[2]});
    }
  }
  for (int r = 0; r < rings; ++r) {
    for (int s = 0; s < segments; ++s) {
      const auto at = [&](int row, int column) {
        return static_cast<uint32_t>(row * segments + column % segments);
      };
      std::array<uint32_t, 6> quad = {at(r, s), at(r + 1, s),     at(r + 1, s + 1),
                                      at(r, s), at(r + 1, s + 1), at(r, s + 1)};
      if (inwards) {
        std::swap(quad[1], quad[2]);
        std::swap(quad[4], quad[5]);
      }
      if (r > 0) indices.insert(indices.end(), quad.begin() + 3, quad.end());
      if (r < rings - 1) indices.insert(indices.end(), quad.begin(), quad.begin() + 3);
    }
  }
  return AddMesh(points, indices, material, {}, normals);
}

int SceneBuilder::AddNode(const nlohmann::json& node) {
  json_["nodes"].push_back(node);
  const int index = static_cast<int>(json_["nodes"].size()) - 1;
  json_["scenes"][0]["nodes"].push_back(index);
  return index;
}

int SceneBuilder::PlaceMesh(int mesh, const Point& translation) {
  return AddNode({{"mesh", mesh}, {"translation", translation}});
}

int SceneBuilder::AddCamera(const Point& eye, double yfov) {
  json_["cameras"].push_back(
      {{"type", "perspective"}, {"perspective", {{"yfov", yfov}, {"znear", 0.01}}}});
  return AddNode({{"camera", json_["cameras"].size() - 1}, {"translation", eye}});
}

int SceneBuilder::AddCameraAbove(const Point& eye, double half) {
  json_["cameras"].push_back(
      {{"type", "orthographic"},
       {"orthographic", {{"xmag", half}, {"ymag", half}, {"znear", 0}, {"zfar", 100}}}});
  return AddNode({{"camera", json_["cameras"].size() - 1},
                  {"translation", eye},
                  {"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}}});
}

int SceneBuilder::AddPunctual(const nlohmann::json& light, nlohmann::json node) {
  DeclareExtension("KHR_lights_punctual");
  nlohmann::json& lights = json_["extensions"]["KHR_lights_punctual"]["lights"];
  lights.push_back(light);
  node["extensions"]["KHR_lights_punctual"] = {{"light", lights.size() - 1}};
  return AddNode(node);
}

std::filesystem::path SceneBuilder::Write(const std::filesystem::path& folder,
                                          const std::string& name) const {
  nlohmann::json whole = json_;
  if (!buffer_.empty())
    whole["buffers"] = {{{"byteLength", buffer_.size()},
                         {"uri", "data:application/octet-stream;base64," + Base64(buffer_)}}};
  const std::filesystem::path path = folder / (name + ".gltf");
  std::ofstream(path) << whole.dump(1);
  return path;
}

ScratchFolder::ScratchFolder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "carpool-test-XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr)
    throw std::runtime_error("cannot make a temporary folder");
  path_ = pattern;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace carpool::test
