// Cameras and KHR_lights_punctual: each once per node that carries it.
#include "render/gltf/lights_cameras.h"

#include <algorithm>

namespace carpool::render::gltf {
namespace {

constexpr char kLights[] = "KHR_lights_punctual";

void CheckWorld(const Document& document, const NodeTree& tree, int node) {
  if (!IsFinite(tree.worlds[node])) {
    document.Fail(Pointer("nodes", node), "the node's transform is not finite; repair it");
  }
}

const Json& LightList(const Document& document) {
  static const Json kEmpty = Json::array();
  const Json* extension = Extension(document.json, kLights);
  return extension ? (*extension)["lights"] : kEmpty;
}

CameraNode ReadCamera(const Document& document, int index) {
  const Json& json = document.Items("cameras")[index];
  const std::string type = json["type"];
  CameraNode camera;
  camera.camera_name = Get<std::string>(json, "name", "");
  camera.orthographic = type == "orthographic";
  if (!json.contains(type)) {
    document.Fail(Pointer("cameras", index),
                  "the object '" + type + "' is missing; export the file again");
  }
  const Json& lens = json[type];
  camera.znear = lens["znear"];
  camera.zfar = Get(lens, "zfar", 0.0);
  if (!camera.orthographic) {
    camera.yfov = lens["yfov"];
    camera.aspect = Get(lens, "aspectRatio", 0.0);
    return camera;
  }
  // A negative extent would flip the picture, which the specification tells writers not to do.
  camera.xmag = std::fabs(lens["xmag"].get<double>());
  camera.ymag = std::fabs(lens["ymag"].get<double>());
  if (camera.xmag == 0 || camera.ymag == 0) {
    document.Fail(Pointer("cameras", index, "orthographic"),
                  "xmag and ymag must not be 0; correct the camera");
  }
  return camera;
}

PunctualLight ReadLight(Document& document, int index) {
  const Json& json = LightList(document)[index];
  const std::string type = json["type"];
  PunctualLight light;
  light.name = Get<std::string>(json, "name", "");
  light.type = type == "point"  ? PunctualType::point
               : type == "spot" ? PunctualType::spot
                                : PunctualType::directional;
  light.color = Numbers<3>(json, "color", {1, 1, 1});
  light.intensity = Get(json, "intensity", 1.0);
  light.range = light.type == PunctualType::directional ? 0 : Get(json, "range", 0.0);
  if (light.type != PunctualType::spot) return light;
  const Json& spot = Child(json, "spot");
  const double half_pi = 1.5707963267948966;
  const double inner = Get(spot, "innerConeAngle", 0.0),
               outer = Get(spot, "outerConeAngle", half_pi / 2);
  light.outer_cone = std::min(outer, half_pi);
  light.inner_cone = std::min(inner, light.outer_cone);
  if (light.outer_cone != outer || light.inner_cone != inner) {
    document.Warn("cone angles",
                  "/extensions/KHR_lights_punctual/lights/" + std::to_string(index) + "/spot",
                  "the cone angles are out of range or order and were clamped");
  }
  return light;
}

std::string NodeName(const Document& document, int node, const std::string& otherwise) {
  const std::string name = Get<std::string>(document.Items("nodes")[node], "name", "");
  return name.empty() ? otherwise : name;
}

}  // namespace

std::vector<CameraNode> ReadCameras(const Document& document, const NodeTree& tree) {
  std::vector<CameraNode> cameras;
  for (int node : tree.drawn) {
    const Json& json = document.Items("nodes")[node];
    if (!json.contains("camera")) continue;
    CheckWorld(document, tree, node);
    CameraNode camera = ReadCamera(document, json["camera"]);
    camera.name = NodeName(document, node, camera.camera_name);
    camera.node = node;
    camera.world = tree.worlds[node];
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

std::vector<PunctualLight> ReadLights(Document& document, const NodeTree& tree) {
  std::vector<PunctualLight> lights;
  const size_t count = CountLights(document);
  for (int node : tree.drawn) {
    const Json* extension = Extension(document.Items("nodes")[node], kLights);
    if (!extension) continue;
    CheckWorld(document, tree, node);
    const uint64_t index = (*extension)["light"];
    if (index >= count) {
      document.Fail(Pointer("nodes", node, "extensions", kLights, "light"),
                    "refers to light " + std::to_string(index) + ", but the file has " +
                        std::to_string(count) + "; correct the file or export it again");
    }
    PunctualLight light = ReadLight(document, static_cast<int>(index));
    light.name = NodeName(document, node, light.name);
    light.node = node;
    light.world = tree.worlds[node];
    lights.push_back(std::move(light));
  }
  return lights;
}

uint64_t CountLights(const Document& document) {
  return LightList(document).size();
}

}  // namespace carpool::render::gltf
