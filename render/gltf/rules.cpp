// glTF 2.0's schema as a list of rules: what the import reads, and nothing else.
#include <cfloat>

#include "render/gltf/schema.h"

namespace carpool::render::gltf {
namespace {

constexpr double kMostItems = 2147483647;          // indices are 32 bit everywhere after the import
constexpr double kMostBytes = 9007199254740992.0;  // 2^53: sums of two still fit 64 bits exactly
constexpr double kMostFloat = FLT_MAX;

/// A list under construction; each function adds one rule.
class RuleList {
 public:
  void Object(const std::string& path, bool required = false) {
    rules_.push_back({.path = path, .type = Type::object, .required = required});
  }
  void Array(const std::string& path, bool required = false, double least = 0) {
    rules_.push_back({.path = path,
                      .type = Type::array,
                      .required = required,
                      .least = least,
                      .most = kMostItems});
  }
  /// An array of objects.
  void Objects(const std::string& path, bool required = false) {
    Array(path, required);
    Object(path + "/*");
  }
  void String(const std::string& path, bool required = false) {
    rules_.push_back({.path = path, .type = Type::string, .required = required});
  }
  void Boolean(const std::string& path) { rules_.push_back({.path = path, .type = Type::boolean}); }
  void Integer(const std::string& path, double least, double most, bool required = false) {
    rules_.push_back(
        {.path = path, .type = Type::integer, .required = required, .least = least, .most = most});
  }
  void Number(const std::string& path, double least, double most, bool required = false) {
    rules_.push_back(
        {.path = path, .type = Type::number, .required = required, .least = least, .most = most});
  }
  void Numbers(const std::string& path, size_t length, double least = -kMostFloat,
               double most = kMostFloat) {
    rules_.push_back(
        {.path = path, .type = Type::numbers, .least = least, .most = most, .length = length});
  }
  void Words(const std::string& path, std::vector<std::string> words, bool required = false) {
    rules_.push_back(
        {.path = path, .type = Type::one_of, .required = required, .words = std::move(words)});
  }
  void Values(const std::string& path, std::vector<int> values, bool required = false) {
    rules_.push_back(
        {.path = path, .type = Type::one_of, .required = required, .values = std::move(values)});
  }
  void Index(const std::string& path, const std::string& target, bool required = false) {
    rules_.push_back(
        {.path = path, .type = Type::reference, .required = required, .target = target});
  }
  void Indices(const std::string& path, const std::string& target, bool required = false) {
    rules_.push_back(
        {.path = path, .type = Type::references, .required = required, .target = target});
  }
  /// The object `extensions/NAME` of the object at `parent`.
  std::string Extension(const std::string& parent, const std::string& name) {
    Object(parent + "/extensions/" + name);
    return parent + "/extensions/" + name;
  }
  /// What a top-level array's members have in common.
  void Named(const std::string& path) {
    Objects(path);
    String(path + "/*/name");
    Object(path + "/*/extensions");
  }
  std::vector<Rule> Take() { return std::move(rules_); }

 private:
  std::vector<Rule> rules_;
};

void AddFile(RuleList& rules) {
  rules.Object("asset", true);
  rules.String("asset/version", true);
  rules.String("asset/minVersion");
  rules.String("asset/generator");
  rules.String("asset/copyright");
  rules.Array("extensionsUsed");
  rules.String("extensionsUsed/*");
  rules.Array("extensionsRequired");
  rules.String("extensionsRequired/*");
  rules.Object("extensions");
  // First all arrays, so that references can be checked against their lengths.
  for (const char* name :
       {"accessors", "animations", "buffers", "bufferViews", "cameras", "images", "materials",
        "meshes", "nodes", "samplers", "scenes", "skins", "textures"}) {
    rules.Named(name);
  }
  rules.Index("scene", "scenes");
  rules.Indices("scenes/*/nodes", "nodes");
}

void AddData(RuleList& rules) {
  rules.String("buffers/*/uri");
  rules.Integer("buffers/*/byteLength", 1, kMostBytes, true);
  rules.Index("bufferViews/*/buffer", "buffers", true);
  rules.Integer("bufferViews/*/byteOffset", 0, kMostBytes);
  rules.Integer("bufferViews/*/byteLength", 1, kMostBytes, true);
  rules.Integer("bufferViews/*/byteStride", 4, 252);
  rules.Index("accessors/*/bufferView", "bufferViews");
  rules.Integer("accessors/*/byteOffset", 0, kMostBytes);
  rules.Values("accessors/*/componentType", {5120, 5121, 5122, 5123, 5125, 5126}, true);
  rules.Boolean("accessors/*/normalized");
  rules.Integer("accessors/*/count", 1, kMostItems, true);
  rules.Words("accessors/*/type", {"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"}, true);
  rules.Object("accessors/*/sparse");
  rules.Integer("accessors/*/sparse/count", 1, kMostItems, true);
  rules.Object("accessors/*/sparse/indices", true);
  rules.Index("accessors/*/sparse/indices/bufferView", "bufferViews", true);
  rules.Integer("accessors/*/sparse/indices/byteOffset", 0, kMostBytes);
  rules.Values("accessors/*/sparse/indices/componentType", {5121, 5123, 5125}, true);
  rules.Object("accessors/*/sparse/values", true);
  rules.Index("accessors/*/sparse/values/bufferView", "bufferViews", true);
  rules.Integer("accessors/*/sparse/values/byteOffset", 0, kMostBytes);
}

void AddMeshes(RuleList& rules) {
  rules.Objects("meshes/*/primitives", true);
  rules.Object("meshes/*/primitives/*/attributes", true);
  rules.Index("meshes/*/primitives/*/attributes/*", "accessors");
  rules.Index("meshes/*/primitives/*/indices", "accessors");
  rules.Index("meshes/*/primitives/*/material", "materials");
  rules.Integer("meshes/*/primitives/*/mode", 0, 6);
  rules.Objects("meshes/*/primitives/*/targets");
  rules.Index("meshes/*/primitives/*/targets/*/*", "accessors");
  rules.Object("meshes/*/primitives/*/extensions");
  rules.Numbers("meshes/*/weights", 0);
}

void AddNodes(RuleList& rules) {
  rules.Indices("nodes/*/children", "nodes");
  rules.Index("nodes/*/mesh", "meshes");
  rules.Index("nodes/*/camera", "cameras");
  rules.Index("nodes/*/skin", "skins");
  rules.Numbers("nodes/*/weights", 0);
  rules.Numbers("nodes/*/matrix", 16);
  rules.Numbers("nodes/*/translation", 3);
  rules.Numbers("nodes/*/rotation", 4);
  rules.Numbers("nodes/*/scale", 3);
  rules.Indices("skins/*/joints", "nodes", true);
  rules.Index("skins/*/skeleton", "nodes");
  rules.Index("skins/*/inverseBindMatrices", "accessors");
  const std::string instancing = rules.Extension("nodes/*", "EXT_mesh_gpu_instancing");
  rules.Object(instancing + "/attributes", true);
  rules.Index(instancing + "/attributes/*", "accessors");
}

void AddCameras(RuleList& rules) {
  const double pi = 3.14159265358979;
  rules.Words("cameras/*/type", {"perspective", "orthographic"}, true);
  rules.Object("cameras/*/perspective");
  rules.Number("cameras/*/perspective/yfov", 1e-6, pi, true);
  rules.Number("cameras/*/perspective/aspectRatio", 1e-6, 1e6);
  rules.Number("cameras/*/perspective/znear", 0, kMostFloat, true);
  rules.Number("cameras/*/perspective/zfar", 0, kMostFloat);
  rules.Object("cameras/*/orthographic");
  rules.Number("cameras/*/orthographic/xmag", -kMostFloat, kMostFloat, true);
  rules.Number("cameras/*/orthographic/ymag", -kMostFloat, kMostFloat, true);
  rules.Number("cameras/*/orthographic/znear", 0, kMostFloat, true);
  rules.Number("cameras/*/orthographic/zfar", 0, kMostFloat, true);
}

void AddLights(RuleList& rules) {
  // Lights are referred to by nodes and live below an extension, which `Index` cannot name; their
  // references are checked where they are read.
  rules.Object("extensions/KHR_lights_punctual");
  const std::string lights = "extensions/KHR_lights_punctual/lights";
  rules.Objects(lights, true);
  rules.String(lights + "/*/name");
  rules.Words(lights + "/*/type", {"point", "spot", "directional"}, true);
  rules.Numbers(lights + "/*/color", 3, 0);
  rules.Number(lights + "/*/intensity", 0, kMostFloat);
  rules.Number(lights + "/*/range", 0, kMostFloat);
  rules.Object(lights + "/*/spot");
  rules.Number(lights + "/*/spot/innerConeAngle", 0, 3.15);
  rules.Number(lights + "/*/spot/outerConeAngle", 0, 3.15);
  const std::string node = rules.Extension("nodes/*", "KHR_lights_punctual");
  rules.Integer(node + "/light", 0, kMostItems, true);
}

void AddTextures(RuleList& rules) {
  rules.String("images/*/uri");
  rules.String("images/*/mimeType");
  rules.Index("images/*/bufferView", "bufferViews");
  rules.Index("textures/*/sampler", "samplers");
  rules.Index("textures/*/source", "images");
  rules.Values("samplers/*/magFilter", {9728, 9729});
  rules.Values("samplers/*/minFilter", {9728, 9729, 9984, 9985, 9986, 9987});
  rules.Values("samplers/*/wrapS", {33071, 33648, 10497});
  rules.Values("samplers/*/wrapT", {33071, 33648, 10497});
}

/// A textureInfo object, with KHR_texture_transform.
void AddTextureInfo(RuleList& rules, const std::string& path) {
  rules.Object(path);
  rules.Index(path + "/index", "textures", true);
  rules.Integer(path + "/texCoord", 0, 1000);
  rules.Object(path + "/extensions");
  const std::string transform = rules.Extension(path, "KHR_texture_transform");
  rules.Numbers(transform + "/offset", 2);
  rules.Number(transform + "/rotation", -kMostFloat, kMostFloat);
  rules.Numbers(transform + "/scale", 2);
  rules.Integer(transform + "/texCoord", 0, 1000);
}

void AddMaterials(RuleList& rules) {
  const std::string material = "materials/*";
  rules.Object(material + "/pbrMetallicRoughness");
  rules.Numbers(material + "/pbrMetallicRoughness/baseColorFactor", 4);
  rules.Number(material + "/pbrMetallicRoughness/metallicFactor", -kMostFloat, kMostFloat);
  rules.Number(material + "/pbrMetallicRoughness/roughnessFactor", -kMostFloat, kMostFloat);
  AddTextureInfo(rules, material + "/pbrMetallicRoughness/baseColorTexture");
  AddTextureInfo(rules, material + "/pbrMetallicRoughness/metallicRoughnessTexture");
  AddTextureInfo(rules, material + "/normalTexture");
  rules.Number(material + "/normalTexture/scale", -kMostFloat, kMostFloat);
  AddTextureInfo(rules, material + "/emissiveTexture");
  rules.Numbers(material + "/emissiveFactor", 3);
  rules.Words(material + "/alphaMode", {"OPAQUE", "MASK", "BLEND"});
  rules.Number(material + "/alphaCutoff", -kMostFloat, kMostFloat);
  rules.Boolean(material + "/doubleSided");
}

void AddMaterialExtensions(RuleList& rules) {
  const std::string emissive = rules.Extension("materials/*", "KHR_materials_emissive_strength");
  rules.Number(emissive + "/emissiveStrength", -kMostFloat, kMostFloat);
  const std::string ior = rules.Extension("materials/*", "KHR_materials_ior");
  rules.Number(ior + "/ior", -kMostFloat, kMostFloat);
  const std::string specular = rules.Extension("materials/*", "KHR_materials_specular");
  rules.Number(specular + "/specularFactor", -kMostFloat, kMostFloat);
  rules.Numbers(specular + "/specularColorFactor", 3);
  AddTextureInfo(rules, specular + "/specularTexture");
  AddTextureInfo(rules, specular + "/specularColorTexture");
  rules.Extension("materials/*", "KHR_materials_unlit");
}

std::vector<Rule> MakeRules() {
  RuleList rules;
  AddFile(rules);
  AddData(rules);
  AddMeshes(rules);
  AddNodes(rules);
  AddCameras(rules);
  AddLights(rules);
  AddTextures(rules);
  AddMaterials(rules);
  AddMaterialExtensions(rules);
  return rules.Take();
}

}  // namespace

const std::vector<Rule>& GltfRules() {
  static const std::vector<Rule> kRules = MakeRules();
  return kRules;
}

}  // namespace carpool::render::gltf
