// Environment tables: integer masses in proportion to luminance x sin(theta), nothing for black,
// nothing lost.
#include "render/lights/environment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

namespace carpool::render {
namespace {

using stages::Environment;
using stages::kEnvironmentMass;

/// Of entry `i` of table `which`, of tables with `count` entries each.
int32_t Mass(const stages::UnsetHugeVector<int32_t>& cdf, size_t which, size_t count, size_t i) {
  const int32_t* const table = &cdf[which * (count + 1)];
  EXPECT_EQ(table[count], kEnvironmentMass);
  return table[i + 1] - table[i];
}

/// A map with some black, one black row and a sun.
std::vector<float> Pixels(int width, int height) {
  std::mt19937 rng(1);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<float> rgb(3ul * width * height);
  for (float& c : rgb) c = uniform(rng);
  for (int x = 0; x < 3 * width; ++x) rgb[6ul * width + x] = 0;
  for (int i = 0; i < width; i += 3) rgb[3ul * i] = rgb[3ul * i + 1] = rgb[3ul * i + 2] = 0;
  rgb[3ul * width * 4 + 10] = 1e7f;
  return rgb;
}

TEST(EnvironmentTables, MassesAreInProportionAndNoneIsLost) {
  constexpr int kWidth = 37, kHeight = 19;
  const std::vector<float> rgb = Pixels(kWidth, kHeight);
  Environment e;
  BuildEnvironment(e, kWidth, kHeight, rgb);
  const auto weight = [&](size_t x, size_t y) {
    const float* c = &rgb[3 * (y * kWidth + x)];
    return (0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]) *
           std::sin(std::numbers::pi * (static_cast<double>(y) + 0.5) / kHeight);
  };
  double total = 0, selected = 0;
  for (size_t y = 0; y < kHeight; ++y) {
    for (size_t x = 0; x < kWidth; ++x) total += weight(x, y);
  }
  for (size_t y = 0; y < kHeight; ++y) {
    const double row = static_cast<double>(Mass(e.row_cdf, 0, kHeight, y)) / kEnvironmentMass;
    double row_weight = 0;
    for (size_t x = 0; x < kWidth; ++x) row_weight += weight(x, y);
    EXPECT_NEAR(row, row_weight / total, 2.0 * kHeight / kEnvironmentMass);
    for (size_t x = 0; x < kWidth; ++x) {
      const int32_t mass = Mass(e.column_cdf, y, kWidth, x);
      const float p = e.texels[4 * (y * kWidth + x) + 3];
      EXPECT_EQ(p > 0, weight(x, y) > 0);
      if (row_weight == 0) continue;  // a row that is never selected
      EXPECT_EQ(mass > 0, weight(x, y) > 0);
      EXPECT_NEAR(mass, weight(x, y) / row_weight * kEnvironmentMass, 2.0 * kWidth);
      EXPECT_FLOAT_EQ(p, static_cast<float>(row * mass / kEnvironmentMass));
      selected += row * mass / kEnvironmentMass;
    }
  }
  EXPECT_DOUBLE_EQ(selected, 1);
}

TEST(EnvironmentTables, UniformMapsHaveEqualMassesAlongARow) {
  Environment e;
  BuildEnvironment(e, 64, 32, std::vector<float>(3 * 64 * 32, 0.7f));
  for (size_t y = 0; y < 32; ++y) {
    for (size_t x = 0; x < 64; ++x) {
      ASSERT_EQ(Mass(e.column_cdf, y, 64, x), kEnvironmentMass / 64);
    }
  }
}

TEST(EnvironmentTables, TheFaintestColourHasMassBesideTheBrightestSun) {
  std::vector<float> rgb(3 * 16 * 8, 0.0f);
  rgb[3 * 5 + 2] = std::numeric_limits<float>::denorm_min();  // blue
  rgb[3 * (16 * 4 + 3)] = std::numeric_limits<float>::max();
  Environment e;
  BuildEnvironment(e, 16, 8, rgb);
  EXPECT_EQ(Mass(e.row_cdf, 0, 8, 0), 1);
  EXPECT_EQ(Mass(e.column_cdf, 0, 16, 5), kEnvironmentMass);
  EXPECT_GT(e.texels[4 * 5 + 3], 0);
}

TEST(EnvironmentTables, InvalidTexelsAreReplacedAndCounted) {
  std::vector<float> rgb(3 * 4 * 2, 1.0f);
  rgb[0] = std::numeric_limits<float>::quiet_NaN();
  rgb[1] = -1;
  rgb[5] = std::numeric_limits<float>::infinity();
  rgb[6] = -std::numeric_limits<float>::infinity();
  rgb[7] = -0.0f;
  Environment e;
  const EnvironmentReport report = BuildEnvironment(e, 4, 2, rgb);
  EXPECT_EQ(report.invalid, 3);
  EXPECT_EQ(report.infinite, 1);
  EXPECT_EQ(e.texels[0], 0);
  EXPECT_EQ(e.texels[1], 0);
  EXPECT_EQ(e.texels[4 + 2], 65504);
  for (const float c : e.texels) EXPECT_TRUE(std::isfinite(c) && c >= 0);
}

TEST(EnvironmentTables, MeanLuminanceWeighsBySolidAngle) {
  Environment e;
  BuildEnvironment(e, 8, 4, std::vector<float>(96, 2.0f));
  EXPECT_NEAR(MeanLuminance(e), 2, 1e-6);
  BuildEnvironment(e, 8, 4, std::vector<float>(96, 0.0f));
  EXPECT_EQ(MeanLuminance(e), 0);
  EXPECT_EQ(MeanLuminance(Environment{}), 0);
}

TEST(EnvironmentTables, ImpossibleSizesAreRefused) {
  Environment e;
  EXPECT_THROW(BuildEnvironment(e, 0, 1, {}), std::invalid_argument);
  EXPECT_THROW(BuildEnvironment(e, -1, -1, {1, 1, 1}), std::invalid_argument);
  EXPECT_THROW(BuildEnvironment(e, 2, 1, {1, 1, 1}), std::invalid_argument);
  EXPECT_THROW(BuildEnvironment(e, 1 << 16, 1 << 16, {1, 1, 1}), std::invalid_argument);
}

}  // namespace
}  // namespace carpool::render
