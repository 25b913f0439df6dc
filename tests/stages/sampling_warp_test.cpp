// The warps: circle, cosine hemisphere and pixel filter against closed forms.
#include <span>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "stages/sampling/filter_table.h"
#include "tests/stages/sampling_kernels.h"
#include "tests/support/statistics.h"

namespace carpool::tests {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLargestUnit = 1 - 0x1p-24;

Columns Points(uint32_t count) {
  Draws draws;
  for (uint32_t i = 0; i < count; ++i) {
    draws.pixel.push_back(i);
    draws.sample.push_back(7);
    draws.vertex.push_back(1);
  }
  return BestSamplingKernels().sample2(draws);
}

/// The corners and the middle of the unit square, padded to a full column.
Columns Corners() {
  Columns u(2);
  for (int i = 0; i < 64; ++i) {
    constexpr double kEdge[] = {0, 0x1p-24, 0.5, kLargestUnit};
    u[0].push_back(kEdge[i % 4]);
    u[1].push_back(kEdge[i / 4 % 4]);
  }
  return u;
}

TEST(Warp, CosSinTurnsIsAccurate) {
  std::vector<double> turns;
  for (int i = -4096; i < 4096; ++i) turns.push_back(i / 1024.0 + i * 1e-7);
  for (double& t : turns) t = static_cast<float>(t);
  for (const SamplingKernels& kernels : AllSamplingKernels()) {
    SCOPED_TRACE(kernels.name);
    const Columns result = kernels.cos_sin({turns});
    const double tolerance = kernels.is_double ? 3e-9 : 1.3e-7;
    for (size_t i = 0; i < turns.size(); ++i) {
      ASSERT_NEAR(result[0][i], std::cos(2 * kPi * turns[i]), tolerance) << turns[i];
      ASSERT_NEAR(result[1][i], std::sin(2 * kPi * turns[i]), tolerance) << turns[i];
    }
  }
}

TEST(Warp, Exp2Minus1IsAccurateDownToTinyArguments) {
  std::vector<double> x;
  for (int i = 0; i < 8192; ++i)
    x.push_back(static_cast<float>(i < 4096 ? i * 29.9 / 4096 : std::exp2(-(i - 4096) / 150.0)));
  for (const SamplingKernels& kernels : AllSamplingKernels()) {
    SCOPED_TRACE(kernels.name);
    const Columns result = kernels.exp2_minus1({x});
    for (size_t i = 0; i < x.size(); ++i) {
      const double expected = std::expm1(x[i] * std::numbers::ln2);
      ASSERT_NEAR(result[0][i], expected, expected * (kernels.is_double ? 1e-7 : 6e-7)) << x[i];
    }
  }
}

TEST(Warp, CosineHemisphereNeverTouchesTheHorizon) {
  for (const SamplingKernels& kernels : AllSamplingKernels()) {
    SCOPED_TRACE(kernels.name);
    const Columns w = kernels.cosine(Corners());
    for (size_t i = 0; i < w[0].size(); ++i) {
      EXPECT_GT(w[2][i], 0);
      EXPECT_NEAR(w[0][i] * w[0][i] + w[1][i] * w[1][i] + w[2][i] * w[2][i], 1, 4e-7);
    }
  }
}

TEST(Warp, CosineHemisphereFollowsItsDensity) {
  constexpr uint32_t kCount = 1 << 18;
  constexpr int kHeights = 16, kTurns = 32;
  const Columns w = BestSamplingKernels().cosine(Points(kCount));
  std::vector<double> counts(kHeights * kTurns, 0);
  for (uint32_t i = 0; i < kCount; ++i) {
    // z^2 is uniform; so is the azimuth.
    const int height = std::min(kHeights - 1, static_cast<int>(w[2][i] * w[2][i] * kHeights));
    const double turn = std::atan2(w[1][i], w[0][i]) / (2 * kPi) + 0.5;
    ++counts[height * kTurns + std::min(kTurns - 1, static_cast<int>(turn * kTurns))];
  }
  const std::vector<double> expected(counts.size(), static_cast<double>(kCount) / counts.size());
  EXPECT_GT(test::ChiSquaredTest(counts, expected), test::kFalseAlarm);
}

/// Mass of the Blackman-Harris window below x pixels.
double FilterMass(double x) {
  const double t = x / stages::kPixelFilterRadius;
  const double sum = 0.48829 * std::sin(kPi * t) + 0.14128 / 2 * std::sin(2 * kPi * t) +
                     0.01168 / 3 * std::sin(3 * kPi * t);
  return 0.5 + (0.35875 * t + sum / kPi) / (2 * 0.35875);
}

TEST(Filter, KnotsInvertTheWindow) {
  const auto knots = std::span(stages::kPixelFilterKnots).first<stages::kPixelFilterCells + 1>();
  for (size_t k = 0; k < knots.size(); ++k) {
    EXPECT_NEAR(FilterMass(knots[k]), static_cast<double>(k) / stages::kPixelFilterCells, 2e-7)
        << k;
    EXPECT_EQ(knots[k], -knots[knots.size() - 1 - k]);
    EXPECT_GT(knots[k], k > 0 ? knots[k - 1] : -2);
  }
}

TEST(Filter, StaysInItsRadius) {
  for (const SamplingKernels& kernels : AllSamplingKernels()) {
    SCOPED_TRACE(kernels.name);
    const Columns offset = kernels.filter(Corners());
    for (size_t i = 0; i < 64; ++i) {
      EXPECT_LE(std::abs(offset[0][i]), stages::kPixelFilterRadius);
      EXPECT_LE(std::abs(offset[1][i]), stages::kPixelFilterRadius);
    }
    EXPECT_EQ(offset[0][0], -stages::kPixelFilterRadius);
    EXPECT_EQ(offset[0][2], 0);
  }
}

TEST(Filter, SamplesFollowTheWindow) {
  constexpr uint32_t kCount = 1 << 18;
  constexpr int kCells = 40;
  const Columns offset = BestSamplingKernels().filter(Points(kCount));
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> counts(kCells, 0);
    test::Mean mean, square;
    for (const double x : offset[axis]) {
      ++counts[static_cast<int>((x / stages::kPixelFilterRadius + 1) / 2 * kCells)];
      mean.Add(x);
      square.Add(x * x);
    }
    double distance = 0, below = 0;
    for (int c = 0; c < kCells; ++c) {
      below += counts[c];
      const double edge = ((c + 1) * 2.0 / kCells - 1) * stages::kPixelFilterRadius;
      distance = std::max(distance, std::abs(below / kCount - FilterMass(edge)));
    }
    // Kolmogorov: exceeded with probability 1e-6 at 2.7 / sqrt(n); cells of 1/256 add at most half
    // of one.
    EXPECT_LT(distance, 2.7 / std::sqrt(kCount) + 0.5 / stages::kPixelFilterCells);
    EXPECT_LT(std::abs(mean.Value()), 5 * mean.Error());
    // The window's variance, numerically; equal-mass cells and the flat outermost one change it
    // slightly.
    double variance = 0;
    for (int i = 0; i < 100000; ++i) {
      const double x = ((i + 0.5) / 50000 - 1) * stages::kPixelFilterRadius;
      const double h = stages::kPixelFilterRadius / 100000;
      variance += x * x * (FilterMass(x + h) - FilterMass(x - h));
    }
    EXPECT_NEAR(square.Value(), variance, 0.004 * variance + 5 * square.Error());
  }
}

}  // namespace
}  // namespace carpool::tests
