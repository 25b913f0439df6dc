// Furnaces: what a surface under uniform light returns, by the renderer's own sampler and sampling.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "stages/tables/bsdf_tables.h"
#include "tests/stages/bsdf_directions.h"
#include "tests/support/statistics.h"

namespace carpool::tests {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr uint32_t kScrambles = 16;
constexpr uint32_t kSamples = 4096;

/// Uniform numbers of each scramble, made once.
const Columns& ScrambleUniforms(uint32_t scramble) {
  static std::vector<Columns> all = [] {
    std::vector<Columns> columns;
    for (uint32_t s = 0; s < kScrambles; ++s) columns.push_back(SamplerUniforms(s, kSamples));
    return columns;
  }();
  return all[scramble];
}

/// Directional albedo with the standard error that the scrambles show; the largest weight met.
struct Furnace {
  test::Mean albedo[3];
  double largest_weight = 0;
};
Furnace MeasureFurnace(const Surface& surface, double mu) {
  Furnace furnace;
  for (uint32_t s = 0; s < kScrambles; ++s) {
    const Columns out = BestBsdfKernels().sample(surface, OutgoingAt(mu), ScrambleUniforms(s));
    for (int c = 0; c < 3; ++c) {
      double sum = 0;
      for (const double weight : out[kWeightR + c]) {
        sum += weight;
        furnace.largest_weight = std::max(furnace.largest_weight, weight);
      }
      furnace.albedo[c].Add(sum / kSamples);
    }
  }
  return furnace;
}

constexpr double kRoughnesses[] = {0, 0.015, 0.03, 0.07, 0.15, 0.3, 0.5, 0.75, 1};
constexpr double kCosines[] = {0.003, 0.02, 0.1, 0.3, 0.6, 1};

/// Student's t with 15 degrees of freedom exceeds 7.8 with probability 1e-6.
constexpr double kDeviations = 7.8;

void ExpectWhite(Surface (*make)(double)) {
  double worst = 0;
  for (const double roughness : kRoughnesses) {
    for (const double mu : kCosines) {
      const Surface surface = make(roughness);
      const Furnace furnace = MeasureFurnace(surface, mu);
      const double residual = mu < 0.01 ? stages::kAlbedoResidualGrazing : stages::kAlbedoResidual;
      const double error = std::abs(furnace.albedo[0].Value() - 1);
      EXPECT_LE(error, residual + kDeviations * furnace.albedo[0].Error())
          << surface.name << ", mu " << mu << ": albedo " << furnace.albedo[0].Value() << " +- "
          << furnace.albedo[0].Error();
      EXPECT_LT(furnace.albedo[0].Error(), 2e-3) << surface.name << ", mu " << mu;
      worst = std::max(worst, error);
    }
  }
  std::printf("%s...: largest |albedo - 1| %.5f\n", make(0).name.substr(0, 16).c_str(), worst);
}

// Hard case 16, and its dielectric twin.
TEST(BsdfEnergy, WhiteMetalReturnsAllLight) {
  ExpectWhite(WhiteMetal);
}
TEST(BsdfEnergy, WhiteDielectricReturnsAllLight) {
  ExpectWhite(WhiteDielectric);
}
TEST(BsdfEnergy, HalfMetalReturnsAllLight) {
  ExpectWhite([](double roughness) {
    Surface s = WhiteDielectric(roughness);
    s.name = "white half metal, roughness " + std::to_string(roughness);
    s.metallic = 0.5;
    return s;
  });
}
TEST(BsdfEnergy, DenseDielectricReturnsAllLight) {
  ExpectWhite([](double roughness) {
    Surface s = WhiteDielectric(roughness);
    s.name = "white at ior 2.4, roughness " + std::to_string(roughness);
    s.ior = 2.4;
    return s;
  });
}

TEST(BsdfEnergy, NoSurfaceReturnsMoreThanItGets) {
  for (const double roughness : kRoughnesses) {
    for (const double mu : kCosines) {
      Surface s = Mixed(roughness);
      s.base[0] = 1;
      const Furnace furnace = MeasureFurnace(s, mu);
      for (const test::Mean& channel : furnace.albedo) {
        EXPECT_LE(channel.Value(),
                  1 + stages::kAlbedoResidualGrazing + kDeviations * channel.Error())
            << s.name << ", mu " << mu;
      }
    }
  }
}

TEST(BsdfEnergy, WeightsAreBounded) {
  double worst = 0;
  for (const double roughness : {0.0, 0.005, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.8, 1.0}) {
    for (const double mu : {1e-4, 0.001, 0.01, 0.05, 0.2, 0.6, 1.0}) {
      for (const Surface& s :
           {WhiteMetal(roughness), WhiteDielectric(roughness), Mixed(roughness)}) {
        const double weight = MeasureFurnace(s, mu).largest_weight;
        EXPECT_LT(weight, 16) << s.name << ", mu " << mu;
        worst = std::max(worst, weight);
      }
    }
  }
  std::printf("largest weight met: %.2f\n", worst);
}

// Hard case 13.
TEST(BsdfEnergy, SingleScatteringAtAlphaOneReturnsOneMinusLnTwo) {
  test::Mean mean;
  for (uint32_t s = 0; s < kScrambles; ++s) {
    const Columns& u = ScrambleUniforms(s);
    const Columns out = BestBsdfKernels().visible(1, {0, 0, 1}, {u[1], u[2]});
    double sum = 0;
    for (const double weight : out[kVisibleWeight]) sum += weight;
    mean.Add(sum / kSamples);
  }
  EXPECT_NEAR(mean.Value(), 1 - std::log(2.0), kDeviations * mean.Error());
  EXPECT_LT(mean.Error(), 2e-4);
}

// Hard case 15: without shadowing, the density of mirror directions is one over the whole sphere.
TEST(BsdfEnergy, WeakWhiteFurnace) {
  constexpr int kHeights = 256, kTurns = 1024;
  for (const double alpha : {0.15, 0.3, 0.6, 1.0}) {
    for (const double mu : {0.1, 0.4, 0.9}) {
      Columns wi(3);
      for (int i = 0; i < kHeights * kTurns; ++i) {
        const double z = (i / kTurns + 0.5) / kHeights * 2 - 1,
                     angle = (i % kTurns + 0.5) / kTurns * 2 * kPi;
        const double sine = std::sqrt((1 - z) * (1 + z));
        wi[0].push_back(sine * std::cos(angle));
        wi[1].push_back(sine * std::sin(angle));
        wi[2].push_back(z);
      }
      double sum = 0;
      for (const double pdf : ReferenceBsdfKernels().visible_pdf(alpha, OutgoingAt(mu), wi))
        sum += pdf;
      EXPECT_NEAR(sum * 4 * kPi / (kHeights * kTurns), 1, 2e-3)
          << "alpha " << alpha << ", mu " << mu;
    }
  }
}

}  // namespace
}  // namespace carpool::tests
