// Where our BSDF departs from the glTF sample BRDF (specification, appendix B), and by how much:
// the figures that stages/README.md states.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "stages/tables/bsdf_tables.h"
#include "tests/stages/bsdf_directions.h"

namespace carpool::tests {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRoughnesses[] = {0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.85, 1};
constexpr double kCosines[] = {0.02, 0.05, 0.1, 0.17364818, 0.3, 0.5, 0.7, 0.85, 1};

double Schlick(double f0, double f90, double cosine) {
  return f0 + (f90 - f0) * std::pow(1 - cosine, 5);
}

/// Albedo of (1 - F(wo.h)) / pi, the sample BRDF's diffuse term on a white base.
double SampleDiffuse(double mu, double f0) {
  constexpr int kSteps = 400;
  const double sine = std::sqrt(1 - mu * mu);
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double z = std::sqrt((i + 0.5) / kSteps);
    for (int j = 0; j < kSteps; ++j) {
      const double cosine =
          z * mu + std::sqrt(1 - z * z) * sine * std::cos(2 * kPi * (j + 0.5) / kSteps);
      sum += 1 - Schlick(f0, 1, std::sqrt((1 + cosine) / 2));
    }
  }
  return sum / (kSteps * kSteps);
}

/// Albedo of single scattering with separable Smith shadowing, which appendix B has, at F = 1.
double SeparableAlbedo(double mu, double alpha) {
  constexpr size_t kCount = 1 << 14;
  Columns u(2);
  for (size_t i = 0; i < kCount; ++i) {
    u[0].push_back((i % 128 + 0.5) / 128);
    u[1].push_back(1 - std::pow((i / 128 + 0.5) / 128, 2));
  }
  const Columns out = ReferenceBsdfKernels().visible(alpha, OutgoingAt(mu), u);
  double sum = 0, weights = 0;
  for (size_t i = 0; i < kCount; ++i) {
    const double z = out[kVisibleZ][i], weight = (i / 128 + 0.5) / 128;
    weights += weight;
    if (z > 0) sum += weight * 2 * z / (z + std::sqrt(z * z + alpha * alpha * (1 - z * z)));
  }
  return sum / weights;
}

/// The largest difference found, and where.
struct Worst {
  double difference = 0, mu = 0, roughness = 0;

  void Add(double d, double at_mu, double at_roughness) {
    if (std::abs(d) > std::abs(difference)) *this = {d, at_mu, at_roughness};
  }
  void Print(const char* what) const {
    std::printf("%-52s %+.3f at mu %.2f, roughness %.2f\n", what, difference, mu, roughness);
  }
};

// White dielectric of ior 1.5: ours returns 1. The sample BRDF's Fresnel-mixed diffuse gains and
// loses.
TEST(BsdfDepartures, DiffuseUnderTheInterface) {
  Worst worst;
  for (const double mu : kCosines) {
    const double diffuse = SampleDiffuse(mu, 0.04);
    for (const double roughness : kRoughnesses) {
      const stages::AlbedoPair e = stages::IntegrateAlbedo(mu, roughness * roughness, 96, 64);
      worst.Add(diffuse + 0.04 * (1 - e.m - e.b) + e.b - 1, mu, roughness);
    }
  }
  worst.Print("glTF - ours, white dielectric");
  EXPECT_NEAR(worst.difference, 0.829, 0.005);
  const double at80 = SampleDiffuse(0.17364818, 0.04) + Schlick(0.04, 1, 0.17364818);
  std::printf("glTF, smooth white dielectric at 80 degrees: %.3f\n", at80);
  EXPECT_NEAR(at80, 1.35, 0.01);
}

TEST(BsdfDepartures, FurtherBounces) {
  Worst worst;
  for (const double mu : kCosines) {
    for (const double roughness : kRoughnesses)
      worst.Add(-stages::IntegrateAlbedo(mu, roughness * roughness, 96, 64).m, mu, roughness);
  }
  worst.Print("glTF with correlated shadowing - ours, white metal");
  EXPECT_NEAR(worst.difference, -0.693, 0.002);
}

TEST(BsdfDepartures, CorrelatedShadowing) {
  Worst worst;
  for (const double mu : kCosines) {
    for (const double roughness : kRoughnesses) {
      const double ours = 1 - stages::IntegrateAlbedo(mu, roughness * roughness, 96, 64).m;
      worst.Add(SeparableAlbedo(mu, roughness * roughness) - ours, mu, roughness);
    }
  }
  worst.Print("separable - correlated shadowing, single scattering");
  EXPECT_NEAR(worst.difference, -0.320, 0.005);
}

// Below ior 1.36 F90 fades; the directional albedo of a black dielectric shows by how much.
TEST(BsdfDepartures, FadingGrazingReflectance) {
  Worst worst[3];
  const double iors[] = {1.33, 1.2, 1.05};
  for (int i = 0; i < 3; ++i) {
    const double faint = std::max(1 - (iors[i] - 1) / 0.36, 0.0), f90 = 1 - faint * faint;
    for (const double mu : kCosines) {
      for (const double roughness : kRoughnesses) {
        worst[i].Add((1 - f90) * stages::IntegrateAlbedo(mu, roughness * roughness, 96, 64).b, mu,
                     roughness);
      }
    }
    worst[i].Print(("glTF - ours, black dielectric, ior " + std::to_string(iors[i])).c_str());
  }
  EXPECT_NEAR(worst[0].difference, 0.006, 0.002);
  EXPECT_NEAR(worst[1].difference, 0.176, 0.005);
  EXPECT_NEAR(worst[2].difference, 0.660, 0.005);
}

}  // namespace
}  // namespace carpool::tests
