// Every instruction set of this machine renders the same picture, up to noise: Welch's t-test on
// image means.
#include <gtest/gtest.h>

#include <cmath>

#include "stages/kernels/kernels.h"
#include "tests/render/session/welch.h"

namespace carpool::test {
namespace {

// False alarms: see WelchT(). Seeds are fixed.
TEST(InstructionSets, AgreeStatistically) {
  const ScratchFolder folder;
  SceneBuilder b;
  const int lamp = b.AddLambert({0, 0, 0}, {1, 1, 1}, 5);
  const int gold =
      b.AddMaterial({{"pbrMetallicRoughness",
                      {{"baseColorFactor", {1, 0.7, 0.3, 1}}, {"roughnessFactor", 0.4}}}});
  b.PlaceMesh(b.AddBox(2, b.AddLambert({0.6, 0.5, 0.7}), true));
  b.PlaceMesh(
      b.AddQuad({-0.5, 1.9, -0.5}, {0.5, 1.9, -0.5}, {0.5, 1.9, 0.5}, {-0.5, 1.9, 0.5}, lamp));
  b.PlaceMesh(b.AddSphere(0.6, 16, gold, false));
  b.AddCamera({0, 0, 1.8}, 1);
  render::RenderSettings settings;
  settings.scene_path = b.Write(folder.path(), "isa").string();
  settings.width = settings.height = 32;
  settings.samples = 16;

  std::vector<Estimate> estimates;
  uint32_t seed = 1;
  for (const stages::Kernels& kernels : stages::AvailableKernels()) {
    settings.isa = render::ParseIsa(kernels.isa);
    estimates.push_back(EstimateMean(settings, seed));
    seed += 1000;
    EXPECT_GT(estimates.back().mean, 0.05) << kernels.isa;
    const Estimate& a = estimates.front();
    const Estimate& c = estimates.back();
    EXPECT_LT(std::abs(WelchT(a, c)), 6.5)
        << kernels.isa << ": " << c.mean << " against " << a.mean;
  }
}

}  // namespace
}  // namespace carpool::test
