// Small glTF files built in code, in a folder that goes away with the test.
#pragma once

#include <cstddef>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "render/gltf/gltf.h"

namespace carpool::render {

using Json = nlohmann::json;

/// A fresh folder under the system's temporary one, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

void WriteText(const std::filesystem::path& path, std::string_view text);

template <typename T>
constexpr int ComponentType() {
  if (std::is_same_v<T, int8_t>) return 5120;
  if (std::is_same_v<T, uint8_t>) return 5121;
  if (std::is_same_v<T, int16_t>) return 5122;
  if (std::is_same_v<T, uint16_t>) return 5123;
  return std::is_same_v<T, uint32_t> ? 5125 : 5126;
}

/// A scene under construction: the JSON, open to any change, and one buffer. Example:
///   SceneBuilder scene;
///   scene.AddTriangle();
///   ImportedScene imported = LoadGltf(scene.WriteGlb(folder / "a.glb"));
class SceneBuilder {
 public:
  SceneBuilder();

  Json json;
  std::string binary;

  /// AddView() appends raw bytes and returns their buffer view.
  int AddView(std::string_view bytes);

  /// AddAccessor() stores values of type "VEC3" and the like, tightly packed, and returns its
  /// index.
  template <typename T>
  int AddAccessor(const std::string& type, const std::vector<T>& values, bool normalized = false) {
    const std::string_view bytes(reinterpret_cast<const char*>(values.data()),
                                 values.size() * sizeof(T));
    Json accessor = {{"bufferView", AddView(bytes)},
                     {"componentType", ComponentType<T>()},
                     {"count", values.size() / Components(type)},
                     {"type", type}};
    if (normalized) accessor["normalized"] = true;
    json["accessors"].push_back(accessor);
    return static_cast<int>(json["accessors"].size()) - 1;
  }

  /// AddMesh() adds a mesh of one primitive and a node that shows it, in scene 0; returns the mesh.
  int AddMesh(const Json& primitive);

  /// AddTriangle() adds a mesh: (0,0,0), (1,0,0), (0,1,0), unindexed.
  int AddTriangle();

  /// AddQuad() adds a mesh: the unit square in the xy plane facing +z, indexed, with normals and
  /// TEXCOORD_0 whose v points down.
  int AddQuad();

  int AddNode(const Json& node, bool in_scene = true);

  std::filesystem::path WriteGlb(const std::filesystem::path& path) const;
  std::filesystem::path WriteGltf(const std::filesystem::path& path) const;  // buffer as data: URI
  std::string Glb() const;
  std::string Gltf() const;

  static size_t Components(const std::string& type);

 private:
  Json Finished() const;
};

/// A one by one white PNG.
std::string TinyPng();
std::string Base64(std::string_view bytes);

/// LoadOptions whose warnings land in `warnings`.
LoadOptions Collect(std::vector<std::string>& warnings);

/// Load() writes the scene as GLB into a folder of its own and imports it.
ImportedScene Load(const SceneBuilder& scene, const LoadOptions& options = {});

/// The line of the InputError that importing throws, or "" where it succeeds.
std::string ErrorOf(const std::filesystem::path& path, const LoadOptions& options = {});
std::string ErrorOf(const SceneBuilder& scene, const LoadOptions& options = {});

/// What the vertices of a shape have, as floats; empty where the shape has no such thing.
std::vector<float> Positions(const ImportedScene& scene, int shape = 0);
std::vector<float> Normals(const ImportedScene& scene, int shape = 0);
std::vector<float> FirstUvs(const ImportedScene& scene, int shape = 0);
/// Another stream, which is in `floats`.
std::vector<float> Stream(const ImportedScene& scene, int shape, int offset, int per_vertex);

}  // namespace carpool::render
