// Directional albedos of the GGX lobe, tabulated: what energy-conserving layers are scaled by.
//
// With Schlick's F = F0 + (F90 - F0)(1 - cos)^5, single-scattering GGX with height-correlated Smith
// shadowing has the albedo F0 A + F90 B at cosine mu. The table keeps M = 1 - A - B (what leaves by
// further scattering) and C = B - (1 - M)(1 - mu)^5 (what roughness adds to the smooth surface's
// Fresnel term); both change over mu ~ alpha, and the coordinate `AlbedoCoordinate` follows them
// there.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace carpool::stages {

/// alpha = roughness^2 is at least kMinRoughness^2 = 1e-4: a half-vector in float locates the peak
/// of D to 1e-3 of its width there, and an image cannot tell 1e-4 from a mirror.
constexpr double kMinRoughness = 0.01;

constexpr int kAlbedoCosines = 48;
constexpr int kAlbedoRoughnesses = 32;    // uniform in roughness from kMinRoughness to 1
constexpr int kAverageRoughnesses = 249;  // likewise; means grow as roughness^4, so they need more

/// Columns of the table of averages: 2 * integral of mu M, of mu B, the log2 below, and one of
/// padding.
constexpr int kAverageColumns = 4;
/// Bounces after the first are sampled with density ~ mu / (mu^2 + b), which follows M when b is
/// about 2 alpha^2; the third column is log2(1 + 1 / b). Any positive value would be correct.
constexpr double kSpreadPerAlpha2 = 2;

/// Fixed-point scales: M in [0, 1] in the upper 16 bits, C in [-1, 1] in the lower.
constexpr double kAlbedoUnitM = 1.0 / 65535;
constexpr double kAlbedoUnitC = 2.0 / 65535;
/// Share of the coordinate that follows mu / alpha; the rest is linear in mu.
constexpr double kAlbedoCoordinateShare = 0.6;

/// Largest error of an interpolated albedo (any F0 <= F90 <= 1), hence of every furnace: for mu >=
/// 0.01, and down to mu = 1e-4. Measured by tests/stages/bsdf_tables_test.cpp.
constexpr double kAlbedoResidual = 0.002;
constexpr double kAlbedoResidualGrazing = 0.004;

/// Borrowed pointers for kernels.
struct BsdfTablesView {
  const int32_t* albedo = nullptr;  // [roughness][cosine]
  const float* average = nullptr;   // [roughness][kAverageColumns]
};

struct BsdfTables {
  /// Two words more than entries: kernels load four at once.
  std::array<int32_t, kAlbedoRoughnesses * kAlbedoCosines + 2> albedo;
  std::array<float, kAverageRoughnesses * kAverageColumns> average;

  BsdfTablesView View() const { return {albedo.data(), average.data()}; }
};

/// The tables, built at first use; thread-safe, and the same bits on every machine.
const BsdfTables& SharedBsdfTables();

/// Position in [0, 1] along the table's cosine axis; kernels use the same formula.
inline double AlbedoCoordinate(double mu, double alpha) {
  return kAlbedoCoordinateShare * std::sqrt(mu * (1 + alpha) / (mu + alpha)) +
         (1 - kAlbedoCoordinateShare) * mu;
}

/// Albedo integrals by quadrature: M and B at one cosine and alpha, with `heights` x `azimuths`
/// points.
struct AlbedoPair {
  double m, b;
};
AlbedoPair IntegrateAlbedo(double mu, double alpha, int heights, int azimuths);

/// The tables read in double, as kernels read them in float.
AlbedoPair InterpolateAlbedo(const BsdfTables& tables, double mu, double roughness);

}  // namespace carpool::stages
