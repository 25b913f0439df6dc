// Builds small glTF scenes in code, as text with the vertex data inside, for tests that need a
// known answer.
#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace carpool::test {

using Point = std::array<double, 3>;

/// A glTF document under construction. Indices that the functions return are glTF indices.
class SceneBuilder {
 public:
  SceneBuilder();

  /// A material from its JSON; extensions it names are declared as used.
  int AddMaterial(const nlohmann::json& material);
  /// A Lambert surface: base colour `albedo`, no specular reflection at all.
  int AddLambert(const Point& albedo, const Point& emission = {0, 0, 0}, double strength = 1);

  /// A texture of 8-bit RGB texels, rows from the top; `sampler` as glTF has it.
  int AddTexture(int width, int height, const std::vector<uint8_t>& rgb,
                 const nlohmann::json& sampler = nlohmann::json::object());

  /// A mesh of triangles; `uvs` and `normals` may be empty.
  int AddMesh(const std::vector<Point>& positions, const std::vector<uint32_t>& indices,
              int material, const std::vector<std::array<double, 2>>& uvs = {},
              const std::vector<Point>& normals = {});
  /// A quadrilateral a, b, c, d, counter-clockwise as seen from its front.
  int AddQuad(const Point& a, const Point& b, const Point& c, const Point& d, int material);
  /// A closed box around the origin whose front faces look inwards (or outwards).
  int AddBox(double half, int material, bool inwards);
  /// A latitude-longitude sphere around the origin; `smooth` gives it the sphere's own normals.
  int AddSphere(double radius, int rings, int material, bool inwards, bool smooth = false);

  int AddNode(const nlohmann::json& node);
  int PlaceMesh(int mesh, const Point& translation = {0, 0, 0});
  /// A perspective camera at `eye`, looking along -Z.
  int AddCamera(const Point& eye, double yfov);
  /// An orthographic camera at `eye` that looks down -Y at a square of 2 `half` a side.
  int AddCameraAbove(const Point& eye, double half);
  /// A punctual light (KHR_lights_punctual) from its JSON, on the node given.
  int AddPunctual(const nlohmann::json& light, nlohmann::json node);

  nlohmann::json& json() { return json_; }

  /// Writes `name`.gltf into `folder` and returns its path.
  std::filesystem::path Write(const std::filesystem::path& folder, const std::string& name) const;

 private:
  void DeclareExtension(const std::string& name);
  int AddAccessor(const std::vector<float>& values, int components);
  int AddIndices(const std::vector<uint32_t>& indices);
  int AddView(const void* data, size_t bytes);

  nlohmann::json json_;
  std::vector<unsigned char> buffer_;
};

/// A fresh folder for one test's files, removed with everything in it at the end.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace carpool::test
