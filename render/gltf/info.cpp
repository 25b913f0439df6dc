// `carpool info`: counting, and the two ways to print the counts.
#include "render/gltf/info.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <string_view>

#include "render/gltf/extensions.h"
#include "render/gltf/lights_cameras.h"
#include "render/gltf/primitive.h"

namespace carpool::render {
namespace gltf {
namespace {

/// All extensions that the file names, each once, in the file's order.
std::vector<ExtensionUse> ListExtensions(const Document& document) {
  std::vector<ExtensionUse> out;
  std::map<std::string, size_t> place;
  for (const char* key : {"extensionsUsed", "extensionsRequired"}) {
    const bool required = key == std::string_view("extensionsRequired");
    for (const Json& item : document.Items(key)) {
      const std::string name = item;
      const auto [found, is_new] = place.try_emplace(name, out.size());
      if (is_new) out.push_back({name, false, IsSupportedExtension(name)});
      out[found->second].required |= required;
    }
  }
  return out;
}

void CountMeshes(const Document& document, SceneSummary& summary) {
  for (const Json& mesh : document.Items("meshes")) {
    for (const Json& primitive : mesh["primitives"]) {
      ++summary.primitives;
      summary.triangles_stored += PrimitiveTriangles(document, primitive);
      if (primitive.contains("targets")) summary.morph_targets += primitive["targets"].size();
    }
  }
}

std::string Line(const char* label, const std::string& text) {
  char buffer[24];
  std::snprintf(buffer, sizeof buffer, "%-15s", label);
  std::string line = buffer + text;
  for (char& c : line)
    c = static_cast<unsigned char>(c) < ' ' ? '?' : c;  // names may hold anything
  return line + "\n";
}

std::string Line(const char* label, uint64_t number) {
  return Line(label, std::to_string(number));
}

std::string ExtensionText(const ExtensionUse& use) {
  return use.name + (use.required ? " (required" : " (optional") +
         (use.supported ? ")" : ", not supported)");
}

std::string CameraText(const CameraNode& camera) {
  char lens[64];
  if (camera.orthographic) {
    std::snprintf(lens, sizeof lens, "orthographic, %.4g x %.4g", 2 * camera.xmag, 2 * camera.ymag);
  } else {
    std::snprintf(lens, sizeof lens, "perspective, %.4g degrees high",
                  camera.yfov * 57.29577951308232);
  }
  return (camera.name.empty() ? "(unnamed)" : camera.name) + std::string(": ") + lens;
}

const char* TypeName(PunctualType type) {
  if (type == PunctualType::point) return "point";
  return type == PunctualType::spot ? "spot" : "directional";
}

std::string LightText(const PunctualLight& light) {
  char power[64];
  std::snprintf(power, sizeof power, ", %.4g %s", light.intensity,
                light.type == PunctualType::directional ? "lux" : "candela");
  return (light.name.empty() ? "(unnamed)" : light.name) + std::string(": ") +
         TypeName(light.type) + power;
}

/// "name" or "3 (name)" of the imported scene.
std::string SceneText(const SceneSummary& summary) {
  if (summary.scene < 0) return "(the file has none: all root nodes)";
  const std::string& name = summary.scenes[summary.scene];
  return std::to_string(summary.scene) + (name.empty() ? "" : " (" + name + ")") + " of " +
         std::to_string(summary.scenes.size());
}

uint64_t CountEmissive(const ImportedScene& scene) {
  return std::count_if(scene.materials.begin(), scene.materials.end(),
                       [](const stages::Material& material) {
                         return (material.flags & stages::kMaterialEmissive) != 0;
                       });
}

}  // namespace

SceneSummary Summarize(const Document& document) {
  SceneSummary summary;
  summary.file = document.name;
  const Json& asset = document.json["asset"];
  summary.generator = Get<std::string>(asset, "generator", "");
  summary.copyright = Get<std::string>(asset, "copyright", "");
  for (const Json& scene : document.Items("scenes"))
    summary.scenes.push_back(Get<std::string>(scene, "name", ""));
  summary.nodes = document.Items("nodes").size();
  summary.meshes = document.Items("meshes").size();
  CountMeshes(document, summary);
  summary.materials = document.Items("materials").size();
  summary.textures = document.Items("textures").size();
  summary.images = document.Items("images").size();
  summary.cameras = document.Items("cameras").size();
  summary.lights = CountLights(document);
  summary.animations = document.Items("animations").size();
  summary.skins = document.Items("skins").size();
  summary.extensions = ListExtensions(document);
  return summary;
}

}  // namespace gltf

std::string DescribeScene(const ImportedScene& scene) {
  using namespace gltf;
  const SceneSummary& s = scene.summary;
  std::string out =
      Line("file", s.file) + Line("size", std::to_string(s.file_bytes) + " bytes read");
  if (!s.generator.empty()) out += Line("generator", s.generator);
  if (!s.copyright.empty()) out += Line("copyright", s.copyright);
  out += Line("scene", SceneText(s)) + Line("nodes", s.nodes);
  out += Line("meshes",
              std::to_string(s.meshes) + " with " + std::to_string(s.primitives) + " primitives");
  out += Line("triangles", std::to_string(s.triangles_stored) + " stored, " +
                               std::to_string(s.triangles_drawn) + " drawn by " +
                               std::to_string(scene.geometry.instances.size()) + " instances");
  out += Line("materials", std::to_string(s.materials) + ", " +
                               std::to_string(CountEmissive(scene)) + " emissive");
  out += Line("textures", std::to_string(s.textures) + " of " + std::to_string(s.images) +
                              " images, " + std::to_string(scene.texture_sources.size()) +
                              " to decode");
  out += Line("animations", s.animations) + Line("skins", s.skins) +
         Line("morph targets", s.morph_targets);
  for (const CameraNode& camera : scene.cameras) out += Line("camera", CameraText(camera));
  for (const PunctualLight& light : scene.lights) out += Line("light", LightText(light));
  for (const ExtensionUse& use : s.extensions) out += Line("extension", ExtensionText(use));
  return out;
}

std::string DescribeSceneJson(const ImportedScene& scene) {
  using namespace gltf;
  const SceneSummary& s = scene.summary;
  Json out = {{"file", s.file},
              {"bytes", s.file_bytes},
              {"generator", s.generator},
              {"copyright", s.copyright},
              {"scenes", s.scenes},
              {"scene", s.scene},
              {"nodes", s.nodes},
              {"meshes", s.meshes},
              {"primitives", s.primitives},
              {"triangles_stored", s.triangles_stored},
              {"triangles_drawn", s.triangles_drawn},
              {"instances", scene.geometry.instances.size()},
              {"materials", s.materials},
              {"emissive_materials", CountEmissive(scene)},
              {"textures", s.textures},
              {"images", s.images},
              {"textures_to_decode", scene.texture_sources.size()},
              {"animations", s.animations},
              {"skins", s.skins},
              {"morph_targets", s.morph_targets}};
  out["cameras"] = out["lights"] = out["extensions"] = Json::array();
  for (const CameraNode& camera : scene.cameras) {
    out["cameras"].push_back({{"name", camera.name},
                              {"node", camera.node},
                              {"type", camera.orthographic ? "orthographic" : "perspective"}});
  }
  for (const PunctualLight& light : scene.lights) {
    out["lights"].push_back({{"name", light.name},
                             {"node", light.node},
                             {"type", TypeName(light.type)},
                             {"intensity", light.intensity}});
  }
  for (const ExtensionUse& use : s.extensions) {
    out["extensions"].push_back(
        {{"name", use.name}, {"required", use.required}, {"supported", use.supported}});
  }
  // File names need not be UTF-8; what is not is replaced rather than thrown at.
  return out.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace carpool::render
