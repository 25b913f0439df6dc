// Materials: factors, texture slots, samplers, and the supported material extensions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/render/gltf/scene_builder.h"

namespace carpool::render {
namespace {

using stages::AlphaMode;
using stages::kNone;
using stages::Material;
using stages::Slot;
using stages::TextureSlot;
using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::FloatNear;
using ::testing::HasSubstr;
using ::testing::Pointwise;
using ::testing::SizeIs;

/// A quad with one material, one image and two textures of it.
SceneBuilder WithMaterial(const Json& material) {
  SceneBuilder scene;
  scene.AddQuad();
  scene.json["meshes"][0]["primitives"][0]["material"] = 0;
  scene.json["images"] = {{{"bufferView", scene.AddView(TinyPng())}, {"mimeType", "image/png"}}};
  scene.json["samplers"] = Json::array({Json::object()});
  scene.json["textures"] = {{{"source", 0}}, {{"source", 0}, {"sampler", 0}}};
  scene.json["materials"] = Json::array({material});
  return scene;
}

Material LoadMaterial(const Json& material) {
  return Load(WithMaterial(material)).materials.at(0);
}

int SlotOf(const Material& material, Slot slot) {
  return material.slots[static_cast<int>(slot)];
}

TEST(Material, DefaultsAreThoseOfTheSpecification) {
  const Material material = LoadMaterial(Json::object());
  EXPECT_THAT(material.base_color, ElementsAre(1, 1, 1, 1));
  EXPECT_THAT(material.emissive, ElementsAre(0, 0, 0));
  EXPECT_EQ(material.metallic, 1);
  EXPECT_EQ(material.roughness, 1);
  EXPECT_EQ(material.alpha_mode, AlphaMode::opaque);
  EXPECT_EQ(material.alpha_cutoff, 0.5f);
  EXPECT_EQ(material.ior, 1.5f);
  EXPECT_EQ(material.specular, 1);
  EXPECT_EQ(material.flags, 0);
  EXPECT_THAT(material.slots, ElementsAre(kNone, kNone, kNone, kNone, kNone, kNone));
}

TEST(Material, CoreFactors) {
  const Material material = LoadMaterial({{"pbrMetallicRoughness",
                                           {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}},
                                            {"metallicFactor", 0.5},
                                            {"roughnessFactor", 0.25}}},
                                          {"emissiveFactor", {1, 0.5, 0}},
                                          {"alphaMode", "MASK"},
                                          {"alphaCutoff", 0.75},
                                          {"doubleSided", true}});
  EXPECT_THAT(material.base_color, ElementsAre(0.1f, 0.2f, 0.3f, 0.4f));
  EXPECT_EQ(material.metallic, 0.5f);
  EXPECT_EQ(material.roughness, 0.25f);
  EXPECT_THAT(material.emissive, ElementsAre(1, 0.5f, 0));
  EXPECT_EQ(material.alpha_mode, AlphaMode::mask);
  EXPECT_EQ(material.alpha_cutoff, 0.75f);
  EXPECT_EQ(material.flags, stages::kMaterialDoubleSided | stages::kMaterialEmissive);
  EXPECT_EQ(LoadMaterial({{"alphaMode", "BLEND"}}).alpha_mode, AlphaMode::blend);
}

TEST(Material, OutOfRangeIsClampedWithOneWarning) {
  SceneBuilder scene =
      WithMaterial({{"pbrMetallicRoughness", {{"metallicFactor", 3}, {"roughnessFactor", -1}}}});
  scene.json["materials"].push_back({{"pbrMetallicRoughness", {{"metallicFactor", 7}}}});
  std::vector<std::string> warnings;
  const ImportedScene imported = Load(scene, Collect(warnings));
  EXPECT_EQ(imported.materials[0].metallic, 1);
  EXPECT_EQ(imported.materials[0].roughness, 0);
  EXPECT_EQ(imported.materials[1].metallic, 1);
  ASSERT_THAT(warnings, SizeIs(2));  // one for metallicFactor, one for roughnessFactor
  EXPECT_THAT(warnings[0], HasSubstr("/materials/0/pbrMetallicRoughness/metallicFactor"));
}

TEST(Material, AllSlotsWithTheirColourSpaces) {
  const Json info = {{"index", 0}};
  const ImportedScene imported = Load(WithMaterial(
      {{"pbrMetallicRoughness", {{"baseColorTexture", info}, {"metallicRoughnessTexture", info}}},
       {"normalTexture", {{"index", 0}, {"scale", -2}}},
       {"emissiveTexture", info},
       {"emissiveFactor", {1, 1, 1}},
       {"extensions",
        {{"KHR_materials_specular",
          {{"specularTexture", info}, {"specularColorTexture", info}}}}}}));
  const Material& material = imported.materials.at(0);
  EXPECT_EQ(material.normal_scale, -2);
  // One image in two colour spaces is decoded twice, whatever the number of slots.
  ASSERT_THAT(imported.texture_sources, SizeIs(2));
  for (const Slot slot : {Slot::base_color, Slot::metallic_roughness, Slot::normal, Slot::emissive,
                          Slot::specular, Slot::specular_color}) {
    ASSERT_NE(SlotOf(material, slot), kNone);
    const bool srgb =
        slot == Slot::base_color || slot == Slot::emissive || slot == Slot::specular_color;
    const TextureSlot& entry = imported.slots.at(SlotOf(material, slot));
    EXPECT_EQ(imported.texture_sources.at(entry.texture).srgb, srgb) << static_cast<int>(slot);
    EXPECT_EQ(imported.texture_sources.at(entry.texture).image, 0);
  }
  EXPECT_EQ(imported.images.at(0).bytes.size(), TinyPng().size());
  EXPECT_NE(imported.geometry.shapes.at(0).tangents, kNone);
}

TEST(Material, AlphaIsCoverageOnlyForTheBaseColourOfWhatIsNotOpaque) {
  const Json info = {{"index", 0}};
  const auto sources = [&](const char* mode) {
    return Load(WithMaterial({{"alphaMode", mode},
                              {"pbrMetallicRoughness", {{"baseColorTexture", info}}},
                              {"emissiveTexture", info},
                              {"emissiveFactor", {1, 1, 1}}}))
        .texture_sources;
  };
  EXPECT_EQ(sources("OPAQUE"), (std::vector<TextureSource>{{.srgb = true}}));
  for (const char* mode : {"MASK", "BLEND"}) {
    EXPECT_EQ(sources(mode),
              (std::vector<TextureSource>{{.srgb = true, .coverage = true}, {.srgb = true}}));
  }
}

TEST(Material, TexturesThatCannotBeSeenAreNotLoaded) {
  SceneBuilder scene =
      WithMaterial({{"emissiveTexture", {{"index", 0}}}, {"occlusionTexture", {{"index", 0}}}});
  scene.json["images"][0] = {{"uri", "missing.png"}};
  const ImportedScene imported = Load(scene);
  EXPECT_TRUE(imported.texture_sources.empty());
  EXPECT_TRUE(imported.images.at(0).bytes.empty());
}

TEST(Material, MissingImages) {
  const Json material = {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}};
  SceneBuilder scene = WithMaterial(material);
  scene.json["images"][0] = {{"uri", "missing.png"}};
  EXPECT_THAT(ErrorOf(scene), HasSubstr("/images/0/uri: file '"));
  scene.json["images"][0] = Json::object();
  EXPECT_THAT(ErrorOf(scene), HasSubstr("/images/0: the image has neither uri nor bufferView"));
  scene.json["images"][0] = {{"uri", "data:image/png;base64,"}};
  EXPECT_THAT(ErrorOf(scene), HasSubstr("/images/0: the image is empty"));
}

TEST(Material, ImagesSayWhereTheyAreFrom) {
  SceneBuilder scene =
      WithMaterial({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
  scene.json["images"][0]["name"] = "wood";
  EXPECT_THAT(Load(scene).images.at(0).where, HasSubstr("scene.glb: /images/0 (wood)"));
}

TEST(Material, ATextureWithoutReadableImageIsLeftOutWithAWarning) {
  SceneBuilder scene =
      WithMaterial({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
  scene.json["textures"][0] = {{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}};
  std::vector<std::string> warnings;
  EXPECT_EQ(SlotOf(Load(scene, Collect(warnings)).materials.at(0), Slot::base_color), kNone);
  EXPECT_THAT(warnings, SizeIs(1));
}

TextureSlot LoadSlot(const Json& info, const Json& sampler = Json::object()) {
  SceneBuilder scene = WithMaterial({{"pbrMetallicRoughness", {{"baseColorTexture", info}}}});
  scene.json["samplers"][0] = sampler;
  return Load(scene).slots.at(0);
}

TEST(Slot, SamplerModes) {
  using namespace stages;
  const Json info = {{"index", 1}};
  EXPECT_EQ(LoadSlot(info).filter, 0);
  EXPECT_EQ(LoadSlot(info).wrap_s, kWrapRepeat);
  const TextureSlot slot =
      LoadSlot(info, {{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}});
  EXPECT_EQ(slot.wrap_s, kWrapClamp);
  EXPECT_EQ(slot.wrap_t, kWrapMirror);
  EXPECT_EQ(slot.filter, kFilterMagNearest);
  const std::pair<int, int> modes[] = {{9728, kFilterMinNearest | kFilterMipNone},
                                       {9729, kFilterMipNone},
                                       {9984, kFilterMinNearest | kFilterMipNearest},
                                       {9985, kFilterMipNearest},
                                       {9986, kFilterMinNearest},
                                       {9987, 0}};
  for (const auto& [gl, filter] : modes)
    EXPECT_EQ(LoadSlot(info, {{"minFilter", gl}}).filter, filter) << gl;
}

Json Transformed(const Json& transform) {
  return {{"index", 0}, {"extensions", {{"KHR_texture_transform", transform}}}};
}

TEST(Slot, TransformFollowsTheExtensionsExample) {
  // "utilizes only the lower left quadrant of the source image, rotated clockwise 90 degrees"
  const TextureSlot slot = LoadSlot(
      Transformed({{"offset", {0, 1}}, {"rotation", 1.57079632679}, {"scale", {0.5, 0.5}}}));
  EXPECT_EQ(slot.has_transform, 1);
  EXPECT_THAT(slot.transform,
              Pointwise(FloatNear(1e-6f), std::vector<float>{0, 0.5f, 0, -0.5f, 0, 1}));
}

TEST(Slot, TransformScalesBeforeItTurns) {
  const TextureSlot slot = LoadSlot(Transformed({{"rotation", 1.57079632679}, {"scale", {2, 3}}}));
  EXPECT_THAT(slot.transform, Pointwise(FloatNear(1e-6f), std::vector<float>{0, 3, 0, -2, 0, 0}));
  EXPECT_EQ(LoadSlot(Transformed(Json::object())).has_transform, 0);
}

TEST(Slot, TransformMayNameAnotherUvSet) {
  Json info = Transformed({{"texCoord", 1}});
  info["texCoord"] = 7;
  SceneBuilder scene = WithMaterial({{"pbrMetallicRoughness", {{"baseColorTexture", info}}}});
  scene.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] =
      scene.AddAccessor<uint8_t>("VEC2", {0, 0, 51, 0, 102, 0, 255, 255}, true);
  const ImportedScene imported = Load(scene);
  EXPECT_THAT(FirstUvs(imported), ElementsAre(0, 0, 0.2f, 0, 0.4f, 0, 1, 1));
}

TEST(Extension, EmissiveStrengthMultiplies) {
  const Material material = LoadMaterial(
      {{"emissiveFactor", {1, 0.5, 0}},
       {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 8}}}}}});
  EXPECT_THAT(material.emissive, ElementsAre(8, 4, 0));
}

TEST(Extension, Ior) {
  const auto load = [](double ior) {
    return LoadMaterial({{"extensions", {{"KHR_materials_ior", {{"ior", ior}}}}}});
  };
  EXPECT_EQ(load(1.33).ior, 1.33f);
  EXPECT_EQ(load(0.5).ior, 1);
  EXPECT_EQ(load(1.33).flags, 0);
  EXPECT_EQ(load(0).flags, stages::kMaterialIorZero);
}

TEST(Extension, Specular) {
  const Material material =
      LoadMaterial({{"extensions",
                     {{"KHR_materials_specular",
                       {{"specularFactor", 0.25}, {"specularColorFactor", {2, 1, 0.5}}}}}}});
  EXPECT_EQ(material.specular, 0.25f);
  EXPECT_THAT(material.specular_color, ElementsAre(2, 1, 0.5f));
}

TEST(Extension, UnlitKeepsOnlyTheBaseColour) {
  const Json info = {{"index", 0}};
  const ImportedScene imported = Load(WithMaterial(
      {{"pbrMetallicRoughness", {{"baseColorTexture", info}, {"metallicRoughnessTexture", info}}},
       {"normalTexture", info},
       {"emissiveFactor", {1, 1, 1}},
       {"doubleSided", true},
       {"extensions", {{"KHR_materials_unlit", Json::object()}}}}));
  const Material& material = imported.materials.at(0);
  EXPECT_EQ(material.flags, stages::kMaterialUnlit | stages::kMaterialDoubleSided);
  EXPECT_NE(SlotOf(material, Slot::base_color), kNone);
  EXPECT_EQ(SlotOf(material, Slot::normal), kNone);
  EXPECT_EQ(SlotOf(material, Slot::metallic_roughness), kNone);
  EXPECT_THAT(material.emissive, ElementsAre(0, 0, 0));
  EXPECT_EQ(imported.geometry.shapes.at(0).tangents, kNone);
}

}  // namespace
}  // namespace carpool::render
