// Rows 42 and 46b: sums that lose nothing, errors that keep falling.
#include <gtest/gtest.h>

#include <cmath>

#include "render/film/resolve.h"
#include "tests/hard_cases/checks.h"
#include "tests/hard_cases/scenes.h"
#include "tests/render/session/render_once.h"

namespace carpool::test {
namespace {

/// Row 42: mean 1000, variance 1, 2^28 samples (2^30 at full length): a float sum would stop
/// growing at 2^24 times the sample, and E[x^2] - E[x]^2 in float would be noise.
TEST(HardRow42, TheFilmsMeanAndErrorSurviveManySamples) {
  const uint32_t samples = 1u << (AtFullLength() ? 30 : 28);
  stages::FilmAccumulator film(1, 1, {});
  int64_t sums[stages::kScrambles] = {};
  for (uint32_t i = 0; i < samples; ++i) {
    const int32_t value = ((i * 2654435761u) >> 31) != 0 ? 1001 : 999;
    sums[i % stages::kScrambles] += value;
    const float radiance[3] = {static_cast<float>(value), static_cast<float>(value), 0};
    film.Add(0, i, radiance);
  }
  const auto count = static_cast<double>(samples);
  double mean = 0, squares = 0;
  for (const int64_t sum : sums) mean += static_cast<double>(sum) / count;
  for (const int64_t sum : sums) {
    const double group = static_cast<double>(sum) / (count / stages::kScrambles);
    squares += (group - mean) * (group - mean);
  }
  const double error = std::sqrt(squares / stages::kScrambles / (stages::kScrambles - 1));
  EXPECT_NEAR(render::ResolveBeauty(film)[0] / mean, 1, 1e-6);
  EXPECT_NEAR(render::ResolveStandardError(film)[0] / error, 1, 1e-6);
}

/// Row 46b: the mean squared error of a pixel falls at least as fast as 1 / samples, down to the
/// last: there is no floor.
TEST(HardRow46b, TheErrorFallsWithoutAFloor) {
  for (const ClosedForm& form : LightForms()) {
    if (form.scene.name != "row26_square_mis" && form.scene.name != "row30_one_texel_sun") continue;
    const ScratchFolder folder;
    render::RenderSettings settings = WriteCase(form.scene, folder.path());
    settings.width = settings.height = 8;
    double first = 0, last = 0;
    const int end = AtFullLength() ? 20 : 16;
    for (int log2 = 6; log2 <= end; log2 += 2) {
      settings.samples = 1 << log2;
      const Rendered rendered = RenderOnce(settings);
      double squares = 0;
      for (const float value : *rendered.image.FindFloats("G"))
        squares += std::pow(value / form.claim.expected - 1, 2);
      const double mse = squares / 64;
      std::printf("row 46b, %s: 2^%d samples, relative MSE %.3g\n", form.scene.name.c_str(), log2,
                  mse);
      if (log2 == 6) first = mse;
      last = mse;
    }
    // 64 pixels: each MSE is within a factor of 1.9 of its mean but once in 1e6.
    const double slope = std::log2(last / first) / (end - 6);
    EXPECT_LE(slope, -1 + std::log2(1.9 * 1.9) / (end - 6)) << form.scene.name;
  }
}

}  // namespace
}  // namespace carpool::test
