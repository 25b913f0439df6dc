// Materials as the kernels read them, and what each asks of a mesh's vertices.
#pragma once

#include <string>
#include <vector>

#include "render/gltf/document.h"
#include "render/gltf/textures.h"

namespace carpool::render::gltf {

/// The vertex streams that a material reads beside positions and normals.
struct MaterialNeeds {
  std::vector<int> uv_sets;  // TEXCOORD numbers; slot.uv_set indexes this list
  bool tangents = false;     // a normal map is there
};

struct MaterialTable {
  std::vector<stages::Material> materials;
  std::vector<MaterialNeeds> needs;
  std::vector<std::string> names;
  int default_material = stages::kNone;  // index once something has asked for it

  /// DefaultMaterial() is the index of glTF's default material, appended at the first call.
  int DefaultMaterial();
};

MaterialTable ReadMaterials(Document& document, TextureCollector& textures);

}  // namespace carpool::render::gltf
