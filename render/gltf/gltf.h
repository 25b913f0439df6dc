// glTF 2.0 import, the whole public face: a file in, plain tables and undecoded images out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "render/base/error.h"
#include "stages/tables/geometry.h"
#include "stages/tables/materials.h"

namespace carpool::render {

/// A 3x4 matrix, row-major, in double: node transforms keep their precision until the camera is
/// known.
using Affine = std::array<double, 12>;

struct LoadOptions {
  bool allow_outside = false;  // let URIs leave the scene's folder
  std::string scene;           // name or index of the scene to draw; empty: the file's default
  WarningSink warn;            // each warning once, one line; empty: silence

  // A file can ask for more than a machine has; what passes these limits is refused, not tried. 0
  // is half of the machine's memory.
  uint64_t max_file_bytes = 0;      // of all files and data: URIs together
  uint64_t max_geometry_bytes = 0;  // of vertex streams, indices and instances
};

/// One image as stored. `bytes` is empty where no supported material uses the image.
struct EncodedImage {
  std::vector<std::byte> bytes;
  std::string where;  // "FILE: /images/3 (wood.png)", for messages
};

/// One `stages::Texture` to be decoded: an image as it is used. Each combination occurs once.
struct TextureSource {
  int image = 0;
  bool srgb = false;
  bool coverage = false;  // alpha says how much of a texel is there (MASK, BLEND base colour)
  auto operator<=>(const TextureSource&) const = default;
};

struct CameraNode {
  std::string name;         // the node's name, or else the camera's
  std::string camera_name;  // the camera's own name, which may be shared by several nodes
  int node = 0;
  bool orthographic = false;
  double yfov = 0;    // perspective: radians
  double aspect = 0;  // width / height; 0: not given
  double xmag = 0;    // orthographic: half the width ...
  double ymag = 0;    // ... and half the height of the view
  double znear = 0;
  double zfar = 0;                                      // 0: infinite
  Affine world = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  // camera to world, scale included
};

enum class PunctualType { point, spot, directional };

/// A KHR_lights_punctual light where a node puts it; it shines along its -Z.
struct PunctualLight {
  std::string name;
  int node = 0;
  PunctualType type = PunctualType::point;
  std::array<double, 3> color = {1, 1, 1};  // linear
  double intensity = 1;                     // candela, or lux if directional
  double range = 0;                         // 0: infinite
  double inner_cone = 0;                    // radians from the axis
  double outer_cone = 0.7853981633974483;
  Affine world = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
};

/// What `carpool info` reports about an extension.
struct ExtensionUse {
  std::string name;
  bool required = false;
  bool supported = false;
};

/// What the file holds, drawn or not.
struct SceneSummary {
  std::string file;
  std::string generator;
  std::string copyright;
  uint64_t file_bytes = 0;          // the scene file and the buffers and images read beside it
  std::vector<std::string> scenes;  // names, "" where unnamed
  int scene = -1;                   // the one imported; -1: the file has none, all root nodes are
  uint64_t nodes = 0;
  uint64_t meshes = 0;
  uint64_t primitives = 0;
  uint64_t triangles_stored = 0;  // by accessor counts, each mesh once
  uint64_t triangles_drawn = 0;   // by the imported scene, instances multiplied
  uint64_t materials = 0;
  uint64_t textures = 0;
  uint64_t images = 0;
  uint64_t cameras = 0;
  uint64_t lights = 0;
  uint64_t animations = 0;
  uint64_t skins = 0;
  uint64_t morph_targets = 0;
  std::vector<ExtensionUse> extensions;
};

struct ImportedScene {
  /// Shapes, meshes and instances; instances carry *absolute* world matrices, placements are empty.
  stages::GeometryTables geometry;
  std::vector<stages::Material> materials;     // as in the file, then the default one where used
  std::vector<stages::TextureSlot> slots;      // slot.texture indexes `texture_sources`
  std::vector<TextureSource> texture_sources;  // what to decode, in this order
  std::vector<EncodedImage> images;            // as in the file
  std::vector<CameraNode> cameras;             // of the imported scene, in node order of the walk
  std::vector<PunctualLight> lights;           // likewise
  std::vector<std::string> node_names;         // per glTF node; MeshInstance::object - 1 indexes it
  std::vector<std::string> material_names;     // per entry of `materials`
  SceneSummary summary;
};

/// LoadGltf() reads a .gltf or .glb file and everything it refers to. Throws InputError, and only
/// that, for whatever is wrong with the file; memory use is bounded by the options.
ImportedScene LoadGltf(const std::filesystem::path& path, const LoadOptions& options = {});

/// DescribeScene() is the text of `carpool info`; DescribeSceneJson() the same as one JSON object.
std::string DescribeScene(const ImportedScene& scene);
std::string DescribeSceneJson(const ImportedScene& scene);

}  // namespace carpool::render
