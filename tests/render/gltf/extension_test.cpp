// Extensions: required ones refused by name, optional ones warned about once.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/render/gltf/scene_builder.h"

namespace carpool::render {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

SceneBuilder Requiring(const std::vector<std::string>& names) {
  SceneBuilder scene;
  scene.AddTriangle();
  scene.json["extensionsUsed"] = scene.json["extensionsRequired"] = names;
  return scene;
}

TEST(Extensions, SupportedOnesPassInSilence) {
  std::vector<std::string> warnings;
  EXPECT_EQ(ErrorOf(Requiring({"KHR_lights_punctual", "KHR_texture_transform",
                               "KHR_mesh_quantization", "KHR_materials_emissive_strength",
                               "KHR_materials_ior", "KHR_materials_specular", "KHR_materials_unlit",
                               "EXT_mesh_gpu_instancing"}),
                    Collect(warnings)),
            "");
  EXPECT_THAT(warnings, IsEmpty());
}

TEST(Extensions, UnknownRequiredOnesAreRefusedByName) {
  const std::string error = ErrorOf(Requiring({"KHR_materials_ior", "ACME_fancy"}));
  EXPECT_THAT(error, HasSubstr("/extensionsRequired/1: the file requires extension 'ACME_fancy'"));
}

TEST(Extensions, RequiredOnesThatNothingCarriesAreIgnoredWithAWarning) {
  std::vector<std::string> warnings;
  SceneBuilder scene = Requiring({"MSFT_texture_dds"});
  EXPECT_EQ(ErrorOf(scene, Collect(warnings)), "");
  ASSERT_THAT(warnings, SizeIs(1));
  EXPECT_THAT(warnings[0], HasSubstr("/extensionsRequired/0"));
  EXPECT_THAT(warnings[0], HasSubstr("nothing uses it"));
  // Carried anywhere, even in a texture that nothing shows, it counts.
  scene.json["images"] = {{{"uri", "a.dds"}}};
  scene.json["textures"] = {{{"extensions", {{"MSFT_texture_dds", {{"source", 0}}}}}}};
  EXPECT_THAT(ErrorOf(scene), HasSubstr("requires extension 'MSFT_texture_dds'"));
}

TEST(Extensions, OptionalOnesAreWarnedAboutOnce) {
  SceneBuilder scene;
  scene.AddTriangle();
  scene.json["extensionsUsed"] = {"ACME_fancy", "KHR_materials_ior", "ACME_fancy", "ACME_plain"};
  std::vector<std::string> warnings;
  EXPECT_EQ(ErrorOf(scene, Collect(warnings)), "");
  ASSERT_THAT(warnings, SizeIs(2));
  EXPECT_THAT(warnings[0], HasSubstr("/extensionsUsed/0: optional extension 'ACME_fancy'"));
  EXPECT_THAT(warnings[1], HasSubstr("'ACME_plain'"));
}

TEST(Extensions, NamesCannotBreakTheLine) {
  const std::string error = ErrorOf(Requiring({"EVIL\nname"}));
  EXPECT_EQ(error.find('\n'), std::string::npos);
  EXPECT_NE(error, "");
}

}  // namespace
}  // namespace carpool::render
