// Builds the integer selection tables of an environment map.
#include "render/lights/environment.h"

#include <cmath>
#include <numbers>
#include <span>
#include <stdexcept>
#include <utility>

namespace carpool::render {
namespace {

double Luminance(const float* rgb) { return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]; }

double SinTheta(int row, int height) { return std::sin(std::numbers::pi * (row + 0.5) / height); }

/// Exclusive cumulative integer masses in proportion to `weights`; `weights` become probabilities. Every
/// weight above 0 gets a mass of 1 beforehand, so that rounding never makes a light impossible to find;
/// the rest is dealt by rounding the cumulative sum, which keeps each within 1 of its due.
void Apportion(std::span<double> weights, int32_t* cdf) {
  double total = 0;
  int32_t positive = 0;
  for (const double w : weights) {
    total += w;
    positive += w > 0;
  }
  const double rest = stages::kEnvironmentMass - positive;
  double sum = 0;
  int32_t given = 0, passed = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    cdf[i] = given;
    sum += weights[i];
    passed += weights[i] > 0;
    if (weights[i] > 0) given = passed + static_cast<int32_t>(std::lround(rest * (sum / total)));
    weights[i] = static_cast<double>(given - cdf[i]) / stages::kEnvironmentMass;
  }
}

EnvironmentReport Sanitise(std::vector<float>& rgb) {
  EnvironmentReport report;
  for (float& c : rgb) {
    if (!(c >= 0)) {
      c = 0;
      ++report.invalid;
    } else if (std::isinf(c)) {
      c = 65504;
      ++report.infinite;
    }
  }
  return report;
}

void CheckSize(int width, int height, size_t components) {
  constexpr int64_t kMostTexels = int64_t{1} << 29;
  const int64_t texels = int64_t{width} * height;
  if (width < 1 || height < 1 || width > stages::kEnvironmentMass ||
      height > stages::kEnvironmentMass || texels > kMostTexels ||
      components != static_cast<size_t>(texels) * 3) {
    throw std::invalid_argument("environment map of an impossible size");
  }
}

/// Weights of one row, summed; 0 where nothing is lit.
double RowWeights(const float* rgb, double sin_theta, std::span<double> weights) {
  double sum = 0;
  for (size_t x = 0; x < weights.size(); ++x) {
    weights[x] = Luminance(rgb + 3 * x) * sin_theta;
    sum += weights[x];
  }
  return sum;
}

}  // namespace

EnvironmentReport BuildEnvironment(stages::Environment& environment, int width, int height,
                                   std::vector<float> rgb) {
  CheckSize(width, height, rgb.size());
  const EnvironmentReport report = Sanitise(rgb);
  const size_t w = static_cast<size_t>(width), h = static_cast<size_t>(height);
  stages::Environment built;
  built.width = width;
  built.height = height;
  built.texels.resize(4 * w * h);
  built.row_cdf.resize(h);
  built.column_cdf.resize(w * h);

  std::vector<double> rows(h), columns(w);
  for (size_t y = 0; y < h; ++y) {
    rows[y] = RowWeights(&rgb[3 * w * y], SinTheta(static_cast<int>(y), height), columns);
  }
  Apportion(rows, built.row_cdf.data());
  for (size_t y = 0; y < h; ++y) {
    RowWeights(&rgb[3 * w * y], SinTheta(static_cast<int>(y), height), columns);
    Apportion(columns, &built.column_cdf[w * y]);
    for (size_t x = 0; x < w; ++x) {
      const float* from = &rgb[3 * (w * y + x)];
      float* to = &built.texels[4 * (w * y + x)];
      for (int c = 0; c < 3; ++c) to[c] = from[c];
      to[3] = static_cast<float>(rows[y] * columns[x]);
    }
  }
  environment = std::move(built);
  return report;
}

double MeanLuminance(const stages::Environment& environment) {
  double sum = 0, area = 0;
  for (int y = 0; y < environment.height; ++y) {
    const double sin_theta = SinTheta(y, environment.height);
    for (int x = 0; x < environment.width; ++x) {
      const size_t at = 4 * (static_cast<size_t>(y) * environment.width + x);
      sum += Luminance(&environment.texels[at]) * sin_theta;
      area += sin_theta;
    }
  }
  return area > 0 ? sum / area : 0;
}

}  // namespace carpool::render
