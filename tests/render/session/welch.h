// Compares the expectations of two renders: Welch's t over image means of independent seeds.
#pragma once

#include <cmath>
#include <vector>

#include "tests/render/session/render_once.h"

namespace carpool::test {

/// Mean and variance of the image mean over independent seeds.
struct Estimate {
  double mean = 0, variance = 0;
};

inline constexpr int kSeeds = 16;

inline Estimate EstimateMean(render::RenderSettings settings, uint32_t first_seed) {
  std::vector<double> means;
  for (int i = 0; i < kSeeds; ++i) {
    settings.seed = first_seed + static_cast<uint32_t>(i);
    means.push_back(MeanOf(RenderOnce(settings).image, "G"));
  }
  Estimate e;
  for (const double m : means) e.mean += m / kSeeds;
  for (const double m : means) e.variance += (m - e.mean) * (m - e.mean) / (kSeeds - 1) / kSeeds;
  return e;
}

/// With 16 seeds a side, |t| > 6.5 happens by chance less than once in 1e6 tests.
inline double WelchT(const Estimate& a, const Estimate& b) {
  return (a.mean - b.mean) / std::sqrt(a.variance + b.variance + 1e-30);
}

}  // namespace carpool::test
