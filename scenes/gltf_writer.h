// Writes glTF: meshes, materials and nodes are added, then the whole goes into one file.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "scenes/meshes.h"

namespace carpool::scenes {

using Json = nlohmann::ordered_json;

class GltfWriter {
 public:
  GltfWriter();

  /// AddShape() stores the streams of a mesh once; AddMesh() makes a glTF mesh of it with a
  /// material.
  int AddShape(const TriangleMesh& mesh);
  int AddMesh(int shape, int material, const std::string& name);

  /// AddMaterial() adds a material as given and notes the extensions it uses.
  int AddMaterial(const Json& material);

  /// AddTexture() embeds a PNG and returns its texture.
  int AddTexture(const std::string& png);

  /// AddNode() adds a node as given to the scene.
  int AddNode(const Json& node);

  /// AddCamera() adds a perspective camera at `from` that looks at `to`, +y up.
  void AddCamera(const std::string& name, const std::array<double, 3>& from,
                 const std::array<double, 3>& to, double yfov);

  /// Write() stores a .gltf with its data in the text, or a .glb, by the file's extension. Throws
  /// std::runtime_error where it cannot.
  void Write(const std::filesystem::path& path) const;

 private:
  int AddView(std::string_view bytes);
  int AddAccessor(std::string_view bytes, int component_type, size_t count, const char* type);

  Json json_;
  std::string binary_;
  std::vector<Json> shapes_;
};

}  // namespace carpool::scenes
