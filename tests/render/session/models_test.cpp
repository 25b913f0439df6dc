// Every model of the shared glTF set renders under both executors, to the same bytes and without a
// NaN, or is refused for the right reason.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "tests/render/session/render_once.h"

namespace carpool::test {
namespace {

std::filesystem::path SharedModels() {
  return std::filesystem::path(CARPOOL_SOURCE_DIR) / ".." / "shared" / "gltf";
}

std::vector<std::filesystem::path> ModelFiles() {
  std::set<std::filesystem::path> files;
  std::error_code none;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(SharedModels(), none)) {
    const auto extension = entry.path().extension();
    if (extension == ".gltf" || extension == ".glb") files.insert(entry.path());
  }
  return {files.begin(), files.end()};
}

bool AllFinite(const render::ExrImage& image) {
  for (const char* channel : {"R", "G", "B"}) {
    for (const float value : *image.FindFloats(channel)) {
      if (!std::isfinite(value) || value < 0) return false;
    }
  }
  return true;
}

/// Models, by folder, that require an extension which is not there yet; each must be refused by its
/// name.
const std::map<std::string, std::string> kRefused = {
    {"BoxDraco", "KHR_draco_mesh_compression"}, {"ClearCoatCarPaint", "KHR_materials_clearcoat"}};

void ExpectRefusal(const render::RenderSettings& settings, const std::string& extension) {
  try {
    RenderOnce(settings);
    ADD_FAILURE() << "needs " << extension << " and must say so";
  } catch (const render::Error& error) {
    EXPECT_EQ(error.code(), render::ExitCode::bad_input);
    EXPECT_NE(std::string(error.what()).find(extension), std::string::npos) << error.what();
  }
}

TEST(Models, RenderTheSameUnderBothExecutors) {
  if (!std::filesystem::exists(SharedModels()))
    GTEST_SKIP() << "the shared glTF models are not beside this checkout";
  for (const std::filesystem::path& file : ModelFiles()) {
    SCOPED_TRACE(file.filename().string());
    render::RenderSettings settings;
    settings.scene_path = file.string();
    settings.width = settings.height = 256;
    settings.samples = 16;
    if (const auto refused = kRefused.find(file.parent_path().filename().string());
        refused != kRefused.end()) {
      ExpectRefusal(settings, refused->second);
      continue;
    }
    settings.executor = render::Executor::wavefront;
    const Rendered wavefront = RenderOnce(settings);
    settings.executor = render::Executor::megakernel;
    const Rendered megakernel = RenderOnce(settings);
    EXPECT_TRUE(AllFinite(wavefront.image));
    EXPECT_EQ(wavefront.summary.ledger.Count(), 0u);
    EXPECT_TRUE(PixelBytes(wavefront.image) == PixelBytes(megakernel.image)) << "executors differ";
  }
}

}  // namespace
}  // namespace carpool::test
