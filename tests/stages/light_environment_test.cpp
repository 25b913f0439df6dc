// The environment kernels: what they look up, where they sample, and that the two agree (HARD_CASES
// 30, 31).
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "render/lights/environment.h"
#include "tests/stages/light_harness.h"
#include "tests/support/statistics.h"

namespace carpool::stages {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr float kLargestBelowOne = 0x1.fffffep-1f;

/// A lat-long image with its own bilinear look-up in double, independent of the tables.
struct Map {
  int width, height;
  std::vector<float> rgb;

  Map(int w, int h, float value = 0) : width(w), height(h), rgb(3ul * w * h, value) {}
  float* at(int x, int y) { return &rgb[3ul * (static_cast<size_t>(y) * width + x)]; }
  void Set(int x, int y, float r, float g, float b) {
    at(x, y)[0] = r;
    at(x, y)[1] = g;
    at(x, y)[2] = b;
  }
  const float* Wrapped(int x, int y) const {
    const int cx = ((x % width) + width) % width, cy = std::clamp(y, 0, height - 1);
    return &rgb[3ul * (static_cast<size_t>(cy) * width + cx)];
  }
  template <class F>
  double Bilinear(double u, double v, const F& texel) const {
    const double s = u * width - 0.5, t = v * height - 0.5;
    const int i = static_cast<int>(std::floor(s)), j = static_cast<int>(std::floor(t));
    const double fs = s - i, ft = t - j;
    return (1 - ft) * ((1 - fs) * texel(i, j) + fs * texel(i + 1, j)) +
           ft * ((1 - fs) * texel(i, j + 1) + fs * texel(i + 1, j + 1));
  }
  double Channel(double u, double v, int c) const {
    return Bilinear(u, v, [&](int i, int j) { return double{Wrapped(i, j)[c]}; });
  }
  double Weight(int i, int j) const {
    const float* t = Wrapped(i, j);
    const double row = std::clamp(j, 0, height - 1) + 0.5;
    return (0.2126 * t[0] + 0.7152 * t[1] + 0.0722 * t[2]) * std::sin(kPi * row / height);
  }
  /// Density over the unit square that sampling should have, up to a factor.
  double Density(double u, double v) const {
    return Bilinear(u, v, [&](int i, int j) { return Weight(i, j); });
  }
};

Map Random(int width, int height, uint32_t seed, double share_of_black) {
  Map map(width, height);
  std::mt19937 rng(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (uniform(rng) >= share_of_black)
        map.Set(x, y, uniform(rng), uniform(rng), 9 * uniform(rng));
    }
  }
  return map;
}

/// The tables of a map and a view of them.
struct Built {
  SceneTables scene;
  LightView view;

  explicit Built(const Map& map) {
    render::BuildEnvironment(scene.lights.environment, map.width, map.height, map.rgb);
    scene.lights.environment_probability = 1;
    view = LightViewOf(scene);
  }
};

std::array<double, 3> DirectionOf(double u, double v) {
  const double phi = 2 * kPi * (u - 0.5), theta = kPi * v;
  return {std::sin(theta) * std::sin(phi), std::cos(theta), -std::sin(theta) * std::cos(phi)};
}
double UOf(const float dir[3]) {
  return 0.5 + std::atan2(dir[0], -dir[2]) / (2 * kPi);
}
double VOf(const float dir[3]) {
  return std::atan2(std::hypot(dir[0], dir[2]), dir[1]) / kPi;
}

LightQuery Towards(double u, double v) {
  LightQuery q;
  const auto dir = DirectionOf(u, v);
  for (int i = 0; i < 3; ++i) q.dir[i] = static_cast<float>(dir[i]);
  return q;
}

std::vector<LightQuery> RandomNumbers(size_t count, uint32_t seed) {
  std::mt19937 rng(seed);
  std::vector<LightQuery> queries(count);
  for (LightQuery& q : queries) {
    for (float& u : q.u) u = static_cast<float>(rng() >> 8) * 0x1p-24f;
  }
  return queries;
}

/// Integral over the sphere of f(u, v), by the midpoint rule on a grid that divides every texel
/// alike.
template <class F>
double OverSphere(const Map& map, const F& f) {
  const int nu = map.width * std::max(2, 256 / map.width);
  const int nv = map.height * std::max(2, 256 / map.height);
  double sum = 0;
  for (int j = 0; j < nv; ++j) {
    const double v = (j + 0.5) / nv;
    for (int i = 0; i < nu; ++i) sum += f((i + 0.5) / nu, v) * std::sin(kPi * v);
  }
  return sum * 2 * kPi * kPi / (static_cast<double>(nu) * nv);
}

std::vector<Map> HardMaps() {
  std::vector<Map> maps = {Map(1, 1, 2.5f), Map(1, 4, 1), Random(3, 1, 1, 0), Random(7, 5, 2, 0.5),
                           Random(32, 16, 3, 0.1)};
  Map border = Random(16, 8, 4, 0);
  for (int x = 0; x < 16; ++x) border.Set(x, 0, 0, 0, 0), border.Set(x, 7, 0, 0, 0);
  for (int y = 0; y < 8; ++y) border.Set(0, y, 0, 0, 0), border.Set(15, y, 0, 0, 0);
  maps.push_back(border);
  for (const auto& [x, y] : {std::pair{5, 3}, {0, 0}, {15, 7}, {0, 4}, {8, 7}}) {
    Map sun(16, 8);
    sun.Set(x, y, 1e5f, 9e4f, 7e4f);
    maps.push_back(sun);
  }
  Map blue(16, 8);  // the least luminance a colour can have
  blue.Set(3, 2, 0, 0, 1e-6f);
  maps.push_back(blue);
  return maps;
}

TEST(LightEnvironment, TexelCentresReturnTheirTexel) {
  const Map map = Random(16, 8, 5, 0);
  const Built built(map);
  for (const LightRunner& runner : AllLightRunners()) {
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 16; ++x) {
        const auto r = runner.run(LightKernel::look_up_environment, built.view,
                                  {Towards((x + 0.5) / 16, (y + 0.5) / 8)});
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(r[0].radiance[c], map.Wrapped(x, y)[c], 3e-5) << runner.name << x << ' ' << y;
        }
      }
    }
  }
}

TEST(LightEnvironment, TheMiddleIsMinusZAndTheTopIsUp) {
  Map map(4, 2);
  map.Set(2, 0, 1, 0, 0);  // right of the middle, upper half: +X of -Z, above
  const Built built(map);
  LightQuery q;
  const double theta = kPi / 4, phi = kPi / 4;
  q.dir[0] = static_cast<float>(std::sin(theta) * std::sin(phi));
  q.dir[1] = static_cast<float>(std::cos(theta));
  q.dir[2] = static_cast<float>(-std::sin(theta) * std::cos(phi));
  const auto r = BestLightRunner().run(LightKernel::look_up_environment, built.view, {q});
  EXPECT_NEAR(r[0].radiance[0], 1, 1e-5);
}

TEST(LightEnvironment, LookUpIsBilinearEverywhere) {
  for (const Map& map : HardMaps()) {
    const Built built(map);
    const float largest = *std::max_element(map.rgb.begin(), map.rgb.end());
    std::mt19937 rng(6);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::vector<LightQuery> queries(2000);
    for (LightQuery& q : queries) q = Towards(uniform(rng), uniform(rng));
    for (const LightRunner& runner : AllLightRunners()) {
      const auto results = runner.run(LightKernel::look_up_environment, built.view, queries);
      for (size_t i = 0; i < queries.size(); ++i) {
        const double u = UOf(queries[i].dir), v = VOf(queries[i].dir);
        for (int c = 0; c < 3; ++c) {
          ASSERT_NEAR(results[i].radiance[c], map.Channel(u, v, c), largest * 2e-5) << runner.name;
          ASSERT_EQ(results[i].radiance[c], results[i].wi[c]);  // EnvironmentRadiance
        }
        ASSERT_EQ(results[i].pdf, results[i].distance);  // EnvironmentPdf
      }
    }
  }
}

TEST(LightEnvironment, DensityIntegratesToOne) {
  for (const Map& map : HardMaps()) {
    const Built built(map);
    std::vector<LightQuery> queries;
    std::vector<double> weights;
    OverSphere(map, [&](double u, double v) {
      queries.push_back(Towards(u, v));
      weights.push_back(std::sin(kPi * v));
      return 0;
    });
    const auto results =
        BestLightRunner().run(LightKernel::look_up_environment, built.view, queries);
    double sum = 0;
    for (size_t i = 0; i < results.size(); ++i) {
      sum += results[i].pdf * weights[i] * 2 * kPi * kPi / static_cast<double>(results.size());
    }
    EXPECT_NEAR(sum, 1, 1e-4) << map.width << 'x' << map.height;
  }
}

TEST(LightEnvironment, SamplesFollowTheDensity) {
  constexpr int kBinsU = 48, kBinsV = 24, kFine = 8;
  constexpr size_t kSamples = 200000;
  for (const Map& map : HardMaps()) {
    const Built built(map);
    std::vector<double> expected(kBinsU * kBinsV), counts(kBinsU * kBinsV);
    double total = 0;
    for (int j = 0; j < kBinsV * kFine; ++j) {
      for (int i = 0; i < kBinsU * kFine; ++i) {
        const double density =
            map.Density((i + 0.5) / (kBinsU * kFine), (j + 0.5) / (kBinsV * kFine));
        expected[(j / kFine) * kBinsU + i / kFine] += density;
        total += density;
      }
    }
    for (double& e : expected) e *= kSamples / total;
    for (const LightRunner& runner : AllLightRunners()) {
      if (runner.name.ends_with("x1")) continue;  // the same bits: WidthDoesNotMatter
      std::fill(counts.begin(), counts.end(), 0.0);
      const auto results =
          runner.run(LightKernel::sample_environment, built.view, RandomNumbers(kSamples, 7));
      for (const LightResult& r : results) {
        // Rounding may carry a sample over the edge of a bin, so bins at the border of black are
        // tested by SamplesHaveLight instead.
        const int i = std::clamp(static_cast<int>(UOf(r.wi) * kBinsU), 0, kBinsU - 1);
        const int j = std::clamp(static_cast<int>(VOf(r.wi) * kBinsV), 0, kBinsV - 1);
        counts[j * kBinsU + i] += expected[j * kBinsU + i] > 0;
      }
      EXPECT_GT(test::ChiSquaredTest(counts, expected), test::kFalseAlarm)
          << runner.name << ' ' << map.width << 'x' << map.height;
    }
  }
}

TEST(LightEnvironment, IrradianceEqualsTheTexelSum) {
  const float normals[3][3] = {{0, 1, 0}, {0.6f, -0.48f, 0.64f}, {0, 0, -1}};
  for (const Map& map : HardMaps()) {
    const Built built(map);
    const auto results = BestLightRunner().run(LightKernel::sample_environment, built.view,
                                               RandomNumbers(100000, 8));
    for (const auto& n : normals) {
      const auto cosine = [&](double x, double y, double z) {
        return std::max(0.0, n[0] * x + n[1] * y + n[2] * z);
      };
      for (int c = 0; c < 3; ++c) {
        const double truth = OverSphere(map, [&](double u, double v) {
          const auto dir = DirectionOf(u, v);
          return map.Channel(u, v, c) * cosine(dir[0], dir[1], dir[2]);
        });
        test::Mean estimate;
        for (const LightResult& r : results) {
          estimate.Add(r.radiance[c] * cosine(r.wi[0], r.wi[1], r.wi[2]) / r.pdf);
        }
        const double all =
            OverSphere(map, [&](double u, double v) { return map.Channel(u, v, c); });
        if (truth <= 1e-6 * all) {  // at most the corner of a tent: too rare for a z-test
          EXPECT_LE(estimate.Value(), 1e-4 * all);
          continue;
        }
        EXPECT_LT(estimate.Z(truth, 2e-4), test::kLargestZ)
            << map.width << 'x' << map.height << ' ' << estimate.Value() << " for " << truth;
      }
    }
  }
}

TEST(LightEnvironment, SamplesHaveLight) {
  for (const Map& map : HardMaps()) {
    const Built built(map);
    auto queries = RandomNumbers(50000, 9);
    for (const float x : {0.0f, 0x1p-24f, 0.5f, kLargestBelowOne}) {
      for (const float y : {0.0f, 0x1p-24f, 0.5f, kLargestBelowOne}) {
        LightQuery q;
        q.u[0] = x;
        q.u[1] = y;
        queries.push_back(q);
      }
    }
    for (const LightRunner& runner : AllLightRunners()) {
      for (const LightResult& r :
           runner.run(LightKernel::sample_environment, built.view, queries)) {
        ASSERT_TRUE(std::isfinite(r.pdf) && r.pdf > 0)
            << runner.name << " gives " << r.pdf << " towards " << r.wi[0] << ' ' << r.wi[1] << ' '
            << r.wi[2];
        ASSERT_GT(r.radiance[0] + r.radiance[1] + r.radiance[2], 0) << runner.name;
        ASSERT_NEAR(std::hypot(r.wi[0], r.wi[1], r.wi[2]), 1, 1e-6) << runner.name;
      }
    }
  }
}

TEST(LightEnvironment, DensityOfASampleIsFoundAgainFromItsDirection) {
  for (const Map& map : HardMaps()) {
    const Built built(map);
    const auto samples = BestLightRunner().run(LightKernel::sample_environment, built.view,
                                               RandomNumbers(20000, 10));
    std::vector<LightQuery> queries(samples.size());
    double largest = 0;
    for (size_t i = 0; i < samples.size(); ++i) {
      std::copy(samples[i].wi, samples[i].wi + 3, queries[i].dir);
      const double sin_theta = std::hypot(samples[i].wi[0], samples[i].wi[2]);
      largest = std::max<double>(largest, samples[i].pdf * sin_theta);
    }
    const auto found = BestLightRunner().run(LightKernel::look_up_environment, built.view, queries);
    for (size_t i = 0; i < samples.size(); ++i) {
      const double sin_theta = std::hypot(samples[i].wi[0], samples[i].wi[2]);
      ASSERT_NEAR(found[i].pdf * sin_theta, samples[i].pdf * sin_theta, largest * 2e-5);
    }
  }
}

TEST(LightEnvironment, WhereThereIsRadianceThereIsDensity) {
  const Map map = Random(32, 16, 11, 0.7);
  const Built built(map);
  std::vector<LightQuery> queries;
  for (int j = 0; j < 256; ++j) {
    for (int i = 0; i < 512; ++i) queries.push_back(Towards((i + 0.37) / 512, (j + 0.37) / 256));
  }
  for (const LightRunner& runner : AllLightRunners()) {
    for (const LightResult& r : runner.run(LightKernel::look_up_environment, built.view, queries)) {
      ASSERT_EQ(r.radiance[0] + r.radiance[1] + r.radiance[2] > 0, r.pdf > 0) << runner.name;
    }
  }
}

TEST(LightEnvironment, ABlackMapSelectsNothing) {
  const Built built(Map(4, 2));
  for (const LightRunner& runner : AllLightRunners()) {
    const auto sample =
        runner.run(LightKernel::sample_environment, built.view, RandomNumbers(100, 12));
    for (const LightResult& r : sample) EXPECT_EQ(r.pdf, 0);
    EXPECT_EQ(runner.run(LightKernel::look_up_environment, built.view, {LightQuery{}})[0].pdf, 0);
  }
}

TEST(LightEnvironment, WidthDoesNotMatter) {
  const Map map = Random(19, 11, 13, 0.3);
  const Built built(map);
  const auto queries = RandomNumbers(1003, 14);
  const auto runners = AllLightRunners();
  for (size_t i = 0; i + 1 < runners.size(); i += 2) {
    EXPECT_EQ(runners[i].run(LightKernel::sample_environment, built.view, queries),
              runners[i + 1].run(LightKernel::sample_environment, built.view, queries))
        << runners[i].target;
  }
}

}  // namespace
}  // namespace carpool::stages
