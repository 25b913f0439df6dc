// Materials: metallic-roughness and the supported extensions, with values outside their range
// mended.
#include "render/gltf/materials.h"

#include <algorithm>
#include <cmath>

namespace carpool::render::gltf {
namespace {

using stages::Slot;

class MaterialReader {
 public:
  MaterialReader(Document& document, TextureCollector& textures, int index)
      : document_(document),
        textures_(textures),
        json_(document.Items("materials")[index]),
        pointer_(Pointer("materials", index)) {}

  stages::Material Read() {
    ReadAlpha();
    ReadBase();  // its alpha is coverage unless the mode is OPAQUE
    if (Extension(json_, "KHR_materials_unlit")) {
      // Only the base colour counts; whatever else the material has is for readers without the
      // extension.
      material_.flags |= stages::kMaterialUnlit;
      return material_;
    }
    ReadReflection();
    ReadEmission();
    ReadIor();
    ReadSpecular();
    return material_;
  }

  MaterialNeeds needs;

 private:
  void ReadBase();
  void ReadAlpha();
  void ReadReflection();
  void ReadEmission();
  void ReadIor();
  void ReadSpecular();

  void SetSlot(Slot slot, const Json& owner, const char* key, const TextureSource& use,
               const std::string& pointer) {
    if (!owner.contains(key)) return;
    material_.slots[static_cast<int>(slot)] =
        textures_.AddSlot(owner[key], use, pointer + "/" + key, needs.uv_sets);
  }

  /// `value`, or the nearest one in range with a warning.
  float InRange(double value, double least, double most, const std::string& pointer) {
    const double clamped = std::clamp(value, least, most);
    if (clamped != value) {
      document_.Warn("clamped " + pointer.substr(pointer.rfind('/')), pointer,
                     "is out of range and was clamped; the same is done elsewhere without notice");
    }
    return static_cast<float>(clamped);
  }

  Document& document_;
  TextureCollector& textures_;
  const Json& json_;
  const std::string pointer_;
  stages::Material material_;
};

constexpr double kHuge = 3e38;
constexpr TextureSource kColor{.srgb = true}, kData{.srgb = false};

void MaterialReader::ReadBase() {
  const Json& pbr = Child(json_, "pbrMetallicRoughness");
  const std::string pointer = pointer_ + "/pbrMetallicRoughness";
  const auto color = Numbers<4>(pbr, "baseColorFactor", {1, 1, 1, 1});
  for (int i = 0; i < 4; ++i)
    material_.base_color[i] = InRange(color[i], 0, 1, pointer + "/baseColorFactor");
  SetSlot(Slot::base_color, pbr, "baseColorTexture",
          {.srgb = true, .coverage = material_.alpha_mode != stages::AlphaMode::opaque}, pointer);
  if (Get(json_, "doubleSided", false)) material_.flags |= stages::kMaterialDoubleSided;
}

void MaterialReader::ReadAlpha() {
  const std::string mode = Get<std::string>(json_, "alphaMode", "OPAQUE");
  if (mode == "MASK") material_.alpha_mode = stages::AlphaMode::mask;
  if (mode == "BLEND") material_.alpha_mode = stages::AlphaMode::blend;
  // A cutoff above 1 is allowed and hides everything.
  material_.alpha_cutoff =
      InRange(Get(json_, "alphaCutoff", 0.5), 0, kHuge, pointer_ + "/alphaCutoff");
}

void MaterialReader::ReadReflection() {
  const Json& pbr = Child(json_, "pbrMetallicRoughness");
  const std::string pointer = pointer_ + "/pbrMetallicRoughness";
  material_.metallic = InRange(Get(pbr, "metallicFactor", 1.0), 0, 1, pointer + "/metallicFactor");
  material_.roughness =
      InRange(Get(pbr, "roughnessFactor", 1.0), 0, 1, pointer + "/roughnessFactor");
  SetSlot(Slot::metallic_roughness, pbr, "metallicRoughnessTexture", kData, pointer);
  SetSlot(Slot::normal, json_, "normalTexture", kData, pointer_);
  material_.normal_scale = static_cast<float>(Get(Child(json_, "normalTexture"), "scale", 1.0));
  needs.tangents = material_.slots[static_cast<int>(Slot::normal)] != stages::kNone;
}

void MaterialReader::ReadEmission() {
  double strength = 1;
  if (const Json* extension = Extension(json_, "KHR_materials_emissive_strength")) {
    strength =
        InRange(Get(*extension, "emissiveStrength", 1.0), 0, kHuge, pointer_ + "/emissiveStrength");
  }
  const auto factor = Numbers<3>(json_, "emissiveFactor", {0, 0, 0});
  for (int i = 0; i < 3; ++i) {
    const double clamped = InRange(factor[i], 0, 1, pointer_ + "/emissiveFactor");
    material_.emissive[i] = static_cast<float>(std::min(clamped * strength, kHuge));
    if (material_.emissive[i] > 0) material_.flags |= stages::kMaterialEmissive;
  }
  // Without emission its texture can never be seen, so it is not loaded either.
  if (material_.flags & stages::kMaterialEmissive)
    SetSlot(Slot::emissive, json_, "emissiveTexture", kColor, pointer_);
}

void MaterialReader::ReadIor() {
  const Json* extension = Extension(json_, "KHR_materials_ior");
  if (!extension) return;
  const double ior = Get(*extension, "ior", 1.5);
  if (ior == 0) {
    material_.flags |= stages::kMaterialIorZero;
    material_.ior = 0;
  } else {
    material_.ior = InRange(ior, 1, kHuge, pointer_ + "/ior");
  }
}

void MaterialReader::ReadSpecular() {
  const Json* extension = Extension(json_, "KHR_materials_specular");
  if (!extension) return;
  const std::string pointer = pointer_ + "/extensions/KHR_materials_specular";
  material_.specular =
      InRange(Get(*extension, "specularFactor", 1.0), 0, 1, pointer + "/specularFactor");
  // Colour factors above 1 are allowed; the reflectance they make is clamped where it is computed.
  const auto color = Numbers<3>(*extension, "specularColorFactor", {1, 1, 1});
  for (int i = 0; i < 3; ++i) {
    material_.specular_color[i] = InRange(color[i], 0, kHuge, pointer + "/specularColorFactor");
  }
  SetSlot(Slot::specular, *extension, "specularTexture", kData, pointer);
  SetSlot(Slot::specular_color, *extension, "specularColorTexture", kColor, pointer);
}

}  // namespace

int MaterialTable::DefaultMaterial() {
  if (default_material == stages::kNone) {
    default_material = static_cast<int>(materials.size());
    materials.emplace_back();
    needs.emplace_back();
    names.emplace_back("(default)");
  }
  return default_material;
}

MaterialTable ReadMaterials(Document& document, TextureCollector& textures) {
  MaterialTable table;
  const Json& list = document.Items("materials");
  for (size_t i = 0; i < list.size(); ++i) {
    MaterialReader reader(document, textures, static_cast<int>(i));
    table.materials.push_back(reader.Read());
    table.needs.push_back(std::move(reader.needs));
    table.names.push_back(Get<std::string>(list[i], "name", ""));
  }
  return table;
}

}  // namespace carpool::render::gltf
