// The image is the same bytes whatever drives the kernels: threads, batch sizes, policies,
// executors.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/render/session/busy_scene.h"
#include "tests/render/session/render_once.h"

namespace carpool::test {
namespace {

using render::Aov;
using render::Executor;
using render::RenderSettings;

class Identity : public testing::Test {
 protected:
  RenderSettings Base() const {
    RenderSettings s;
    s.scene_path = BusyScene(folder_.path()).string();
    s.width = 61;  // neither a multiple of a packet's 4 nor of a tile's 16
    s.height = 43;
    s.samples = 6;
    s.threads = 1;
    s.aovs = render::ParseAovs("all");
    return s;
  }
  ScratchFolder folder_;
};

TEST_F(Identity, HoldsForThreadsBatchesPoliciesAndExecutors) {
  const Rendered reference = RenderOnce(Base());
  const std::string expected = PixelBytes(reference.image);
  EXPECT_GT(MeanOf(reference.image, "G"), 0.01) << "the scene must not be black";

  std::vector<std::pair<std::string, RenderSettings>> variants;
  for (const int threads : {2, 8}) {
    RenderSettings s = Base();
    s.threads = threads;
    variants.emplace_back(std::to_string(threads) + " threads", s);
  }
  for (const int batch : {8, 64, 4096}) {
    RenderSettings s = Base();
    s.threads = 2;
    s.batch_items = batch;
    variants.emplace_back("batches of " + std::to_string(batch), s);
  }
  for (const render::Policy policy :
       {render::Policy::deepest, render::Policy::fullest, render::Policy::oldest}) {
    RenderSettings s = Base();
    s.threads = 2;
    s.policy = policy;
    variants.emplace_back("policy " + std::string(render::Name(policy)), s);
  }
  for (const int threads : {1, 2, 8}) {
    RenderSettings s = Base();
    s.executor = Executor::megakernel;
    s.threads = threads;
    variants.emplace_back("megakernel on " + std::to_string(threads), s);
  }
  RenderSettings small_memory = Base();
  small_memory.memory_mb = 1;
  small_memory.threads = 2;
  variants.emplace_back("1 MiB of path state", small_memory);

  for (const auto& [name, settings] : variants) {
    EXPECT_TRUE(PixelBytes(RenderOnce(settings).image) == expected) << name << " changes the image";
  }
}

TEST_F(Identity, HoldsWhileTheFastestExecutorIsFound) {
  RenderSettings wave = Base();
  wave.width = 256;  // enough paths for parts of a pass to be timed
  wave.height = 256;
  wave.samples = 40;
  wave.max_depth = 2;
  wave.threads = 2;
  wave.executor = Executor::wavefront;
  RenderSettings automatic = wave;
  automatic.executor = Executor::automatic;
  const Rendered found = RenderOnce(automatic);
  EXPECT_TRUE(PixelBytes(found.image) == PixelBytes(RenderOnce(wave).image));
  EXPECT_EQ(found.summary.executor_reason.substr(0, 13), "measured here");
}

TEST_F(Identity, AnotherSeedIsAnotherImage) {
  RenderSettings other = Base();
  other.seed = 1;
  EXPECT_FALSE(PixelBytes(RenderOnce(Base()).image) == PixelBytes(RenderOnce(other).image));
}

TEST_F(Identity, HoldsWithAPreviewInBetween) {
  RenderSettings previewed = Base();
  previewed.preview_path = (folder_.path() / "preview.png").string();
  EXPECT_TRUE(PixelBytes(RenderOnce(Base()).image) == PixelBytes(RenderOnce(previewed).image));
  EXPECT_TRUE(std::filesystem::exists(previewed.preview_path));
}

}  // namespace
}  // namespace carpool::test
