// Extensions: the supported ones, required ones that are refused, optional ones that are warned
// about.
#include "render/gltf/extensions.h"

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <vector>

#include "render/gltf/document.h"
#include "render/gltf/uri.h"

namespace carpool::render::gltf {
namespace {

constexpr std::array<std::string_view, 8> kSupported = {
    "EXT_mesh_gpu_instancing", "KHR_lights_punctual",    "KHR_materials_emissive_strength",
    "KHR_materials_ior",       "KHR_materials_specular", "KHR_materials_unlit",
    "KHR_mesh_quantization",   "KHR_texture_transform",
};

/// Extensions that can only act where some object of the file carries them under "extensions".
/// Others may change the meaning of core properties by their name alone, as KHR_mesh_quantization
/// does.
constexpr std::array<std::string_view, 12> kActOnlyWhereNamed = {
    "EXT_meshopt_compression",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_texture_basisu",
    "MSFT_texture_dds",
};

template <size_t N>
bool Contains(const std::array<std::string_view, N>& list, const std::string& name) {
  return std::find(list.begin(), list.end(), name) != list.end();
}

/// True if any object of the file has extensions/NAME.
bool IsCarried(const Json& file, const std::string& name) {
  std::vector<const Json*> open = {&file};
  while (!open.empty()) {
    const Json& value = *open.back();
    open.pop_back();
    if (value.is_object() && value.contains("extensions") && value["extensions"].contains(name))
      return true;
    if (!value.is_structured()) continue;
    for (const Json& member : value) {
      if (member.is_structured()) open.push_back(&member);
    }
  }
  return false;
}

/// A required extension without which the file can still be read right: files in circulation (AMD's
/// GasStation) require MSFT_texture_dds after their last texture has gone. What no object carries
/// cannot matter, so refusing such a file would help nobody.
bool IsProvablyUnused(const Document& document, const std::string& name) {
  return Contains(kActOnlyWhereNamed, name) && !IsCarried(document.json, name);
}

}  // namespace

bool IsSupportedExtension(const std::string& name) {
  return Contains(kSupported, name);
}

void CheckExtensions(Document& document) {
  const Json& required = document.Items("extensionsRequired");
  std::set<std::string>
      seen;  // a name may be repeated any number of times, and IsCarried() reads all
  for (size_t i = 0; i < required.size(); ++i) {
    const std::string name = required[i];
    if (IsSupportedExtension(name) || !seen.insert(name).second) continue;
    const std::string pointer = Pointer("extensionsRequired", i);
    if (!IsProvablyUnused(document, name)) {
      document.Fail(pointer, "the file requires extension " + Quoted(name) +
                                 ", which is not supported; export it without");
    }
    document.Warn(
        "extension " + name, pointer,
        "required extension " + Quoted(name) + " is not supported, but nothing uses it; ignored");
  }
  const Json& used = document.Items("extensionsUsed");
  for (size_t i = 0; i < used.size(); ++i) {
    const std::string name = used[i];
    if (IsSupportedExtension(name)) continue;
    document.Warn(
        "extension " + name, Pointer("extensionsUsed", i),
        "optional extension " + Quoted(name) + " is not supported; the scene is shown without it");
  }
}

}  // namespace carpool::render::gltf
