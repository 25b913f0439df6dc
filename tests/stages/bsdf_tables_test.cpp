// The albedo tables against finer quadrature: the residual that stages/tables/bsdf_tables.h
// declares.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "stages/tables/bsdf_tables.h"

namespace carpool::tests {
namespace {

using stages::AlbedoPair;
using stages::BsdfTables;

/// Largest error of F0 A + F90 B for any 0 <= F0 <= F90 <= 1: it is at (1, 1) or at (0, 1).
double WorstError(const AlbedoPair& a, const AlbedoPair& b) {
  return std::max(std::abs(a.m - b.m), std::abs(a.b - b.b));
}

TEST(BsdfTables, InterpolationStaysWithinTheDeclaredResidual) {
  const BsdfTables& tables = stages::SharedBsdfTables();
  double worst = 0, worst_grazing = 0;
  for (double mu = 1e-4; mu <= 1; mu *= 1.19) {
    for (double roughness = 0.01; roughness <= 1; roughness += 0.0217) {
      const AlbedoPair exact = stages::IntegrateAlbedo(mu, roughness * roughness, 96, 64);
      const double error = WorstError(stages::InterpolateAlbedo(tables, mu, roughness), exact);
      (mu < 0.01 ? worst_grazing : worst) = std::max(mu < 0.01 ? worst_grazing : worst, error);
    }
  }
  std::printf("albedo tables: residual %.5f at mu >= 0.01, %.5f down to 1e-4\n", worst,
              worst_grazing);
  EXPECT_LE(worst, stages::kAlbedoResidual);
  EXPECT_LE(worst_grazing, stages::kAlbedoResidualGrazing);
  // The declaration is not padded either.
  EXPECT_GE(worst, 0.5 * stages::kAlbedoResidual);
}

TEST(BsdfTables, QuadratureHasTheClosedForm) {
  // Single-scattering GGX at alpha 1, normal incidence: 1 - ln 2, so M = ln 2.
  EXPECT_NEAR(stages::IntegrateAlbedo(1, 1, 256, 64).m, std::log(2.0), 2e-5);
  // A mirror: nothing is lost, and B is Schlick's weight.
  for (const double mu : {0.2, 0.5, 0.9}) {
    const AlbedoPair mirror = stages::IntegrateAlbedo(mu, 1e-4, 64, 32);
    EXPECT_NEAR(mirror.m, 0, 1e-6);
    EXPECT_NEAR(mirror.b, std::pow(1 - mu, 5), 1e-5);
  }
}

TEST(BsdfTables, AveragesAreThoseOfTheInterpolatedTable) {
  const BsdfTables& tables = stages::SharedBsdfTables();
  for (double roughness = 0.013; roughness <= 1; roughness += 0.0611) {
    const double row = (roughness - stages::kMinRoughness) / (1 - stages::kMinRoughness) *
                       (stages::kAverageRoughnesses - 1);
    const int i = static_cast<int>(row);
    const float* at = &tables.average[i * stages::kAverageColumns];
    double m = 0, b = 0;
    constexpr int kSteps = 20000;
    for (int k = 0; k < kSteps; ++k) {
      const double t = (k + 0.5) / kSteps;
      const AlbedoPair e = stages::InterpolateAlbedo(tables, t * t * t, roughness);
      m += 6 * std::pow(t, 5) / kSteps * e.m;
      b += 6 * std::pow(t, 5) / kSteps * e.b;
    }
    EXPECT_NEAR(at[0] + (row - i) * (at[stages::kAverageColumns] - at[0]), m, 0.004 * m + 1e-6)
        << roughness;
    EXPECT_NEAR(at[1] + (row - i) * (at[stages::kAverageColumns + 1] - at[1]), b, 0.004 * b)
        << roughness;
  }
}

TEST(BsdfTables, TheBitsAreTheSameOnEveryMachine) {
  const BsdfTables& tables = stages::SharedBsdfTables();
  uint32_t hash = 0;
  constexpr size_t kEntries = stages::kAlbedoRoughnesses * stages::kAlbedoCosines;
  for (size_t i = 0; i < kEntries; ++i) hash = hash * 31 + static_cast<uint32_t>(tables.albedo[i]);
  EXPECT_EQ(hash, 0xccf6b4c1u)
      << "changed tables change every image: if that is meant, put the new hash here";
}

}  // namespace
}  // namespace carpool::tests
