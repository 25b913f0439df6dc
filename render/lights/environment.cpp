// Builds the integer selection tables of an environment map.
#include "render/lights/environment.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <stdexcept>
#include <utility>

namespace carpool::render {
namespace {

double Luminance(const float* rgb) {
  return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

double SinTheta(int row, int height) {
  return std::sin(std::numbers::pi * (row + 0.5) / height);
}

/// Cumulative integer masses in proportion to `weights`: of the entries before each, and of all.
/// `weights` become probabilities. Every weight above 0 gets a mass of 1 beforehand, so that
/// rounding never makes a light impossible to find; the rest is dealt by rounding the cumulative
/// sum, which keeps each within 1 of its due.
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
  cdf[weights.size()] = stages::kEnvironmentMass;
}

/// Fills the guide of a table; see `stages::GuideBits`.
void MakeGuide(std::span<const int32_t> cdf, int32_t* guide) {
  const int32_t count = static_cast<int32_t>(cdf.size()) - 1;
  const int32_t cells = stages::GuideSize(count) - 1, cell = stages::kEnvironmentMass / cells;
  int32_t entry = 0;
  const auto advance = [&](int32_t number) {
    while (cdf[entry + 1] <= number) ++entry;
    return entry;
  };
  for (int32_t k = 0; k < cells; ++k) guide[k] = advance(k * cell);
  guide[cells] = advance(stages::kEnvironmentMass - 1);
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

/// Calls f(row, scratch of `width` numbers) for every row, in parallel.
template <class F>
void EachRow(size_t height, size_t width, const F& f) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, height, 16), [&](const auto& range) {
    std::vector<double> scratch(width);
    for (size_t y = range.begin(); y < range.end(); ++y) f(y, std::span<double>(scratch));
  });
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
  const auto make = [](stages::UnsetHugeVector<int32_t>& table, size_t entries) {
    table.resize(entries);
    table.resize(entries + stages::kTablePadding, 0);
  };
  make(built.row_cdf, h + 1);
  make(built.column_cdf, h * (w + 1));
  make(built.row_guide, stages::GuideSize(height));
  make(built.column_guide, h * stages::GuideSize(width));

  std::vector<double> rows(h);
  const auto weigh = [&](size_t y, std::span<double> columns) {
    return RowWeights(&rgb[3 * w * y], SinTheta(static_cast<int>(y), height), columns);
  };
  EachRow(h, w, [&](size_t y, std::span<double> columns) { rows[y] = weigh(y, columns); });
  Apportion(rows, built.row_cdf.data());
  MakeGuide(std::span(built.row_cdf).first(h + 1), built.row_guide.data());
  EachRow(h, w, [&](size_t y, std::span<double> columns) {
    weigh(y, columns);
    const std::span<int32_t> cdf(&built.column_cdf[(w + 1) * y], w + 1);
    Apportion(columns, cdf.data());
    MakeGuide(cdf, &built.column_guide[y * stages::GuideSize(width)]);
    for (size_t x = 0; x < w; ++x) {
      float* const texel = std::copy_n(&rgb[3 * (w * y + x)], 3, &built.texels[4 * (w * y + x)]);
      *texel = static_cast<float>(rows[y] * columns[x]);
    }
  });
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
