// Sampling against densities: chi-squared over the sphere and around the mirror direction, and
// light sampling against BSDF sampling.
//
// Expected counts integrate the pdf of the double kernels; samples come from the float kernels with
// independent random numbers. False-alarm rate 1e-6 per check, fixed seeds.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/stages/bsdf_directions.h"
#include "tests/support/statistics.h"

namespace carpool::tests {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr size_t kCount = 1 << 18;

using Pdf = std::function<std::vector<double>(const Columns& wi)>;

/// A polar grid around `axis`: cell (ring, sector); rings by the polar angle's edges.
struct Grid {
  Direction axis, tangent, bitangent;
  std::vector<double> edges;
  int sectors;
};

Grid MakeGrid(const Direction& axis, std::vector<double> edges, int sectors) {
  const bool upright = std::abs(axis.z) > 0.9;
  const Direction other = upright ? Direction{1, 0, 0} : Direction{0, 0, 1};
  Direction t{other.y * axis.z - other.z * axis.y, other.z * axis.x - other.x * axis.z,
              other.x * axis.y - other.y * axis.x};
  const double length = std::hypot(t.x, t.y, t.z);
  t = {t.x / length, t.y / length, t.z / length};
  const Direction b{axis.y * t.z - axis.z * t.y, axis.z * t.x - axis.x * t.z,
                    axis.x * t.y - axis.y * t.x};
  return {axis, t, b, std::move(edges), sectors};
}

/// Cell of a direction. The angle comes from its sine near the axis: acos would lose it.
size_t CellOf(const Grid& grid, double x, double y, double z) {
  const double a = x * grid.tangent.x + y * grid.tangent.y + z * grid.tangent.z;
  const double b = x * grid.bitangent.x + y * grid.bitangent.y + z * grid.bitangent.z;
  const double c = x * grid.axis.x + y * grid.axis.y + z * grid.axis.z;
  const double angle = std::atan2(std::hypot(a, b), c);
  const auto above = std::upper_bound(grid.edges.begin() + 1, grid.edges.end() - 1, angle);
  const auto ring = static_cast<size_t>(above - grid.edges.begin() - 1);
  const int sector = static_cast<int>((std::atan2(b, a) / (2 * kPi) + 0.5) * grid.sectors);
  return ring * grid.sectors + std::min(sector, grid.sectors - 1);
}

/// Mass of the pdf in each cell of one ring, by `fine` x `fine` midpoints a cell.
void AddRing(const Grid& grid, size_t ring, const Pdf& pdf, int fine, std::vector<double>& masses) {
  const int points = grid.sectors * fine * fine;
  const int padded = (points + 63) / 64 * 64;
  Columns wi(3, std::vector<double>(padded, 1));
  std::vector<double> areas(points);
  const double step = (grid.edges[ring + 1] - grid.edges[ring]) / fine;
  for (int i = 0; i < points; ++i) {
    const int sector = i / (fine * fine), within = i % (fine * fine);
    const double angle = grid.edges[ring] + (within / fine + 0.5) * step;
    const double turn = ((sector + (within % fine + 0.5) / fine) / grid.sectors - 0.5) * 2 * kPi;
    const double s = std::sin(angle), u = s * std::cos(turn), v = s * std::sin(turn),
                 w = std::cos(angle);
    wi[0][i] = u * grid.tangent.x + v * grid.bitangent.x + w * grid.axis.x;
    wi[1][i] = u * grid.tangent.y + v * grid.bitangent.y + w * grid.axis.y;
    wi[2][i] = u * grid.tangent.z + v * grid.bitangent.z + w * grid.axis.z;
    areas[i] = s * step * 2 * kPi / (grid.sectors * fine);
  }
  const std::vector<double> density = pdf(wi);
  for (int i = 0; i < points; ++i)
    masses[ring * grid.sectors + i / (fine * fine)] += density[i] * areas[i];
}

std::vector<double> Masses(const Grid& grid, const Pdf& pdf, int fine) {
  std::vector<double> masses((grid.edges.size() - 1) * grid.sectors, 0);
  for (size_t ring = 0; ring + 1 < grid.edges.size(); ++ring)
    AddRing(grid, ring, pdf, fine, masses);
  return masses;
}

/// Polar angles around the surface normal, equal steps of cosine, over the whole sphere.
Grid SphereGrid() {
  std::vector<double> edges;
  for (int i = 0; i <= 40; ++i) edges.push_back(std::acos(std::clamp(1 - i / 20.0, -1.0, 1.0)));
  return MakeGrid({0, 0, 1}, edges, 24);
}

/// Rings around the mirror direction in units of alpha, then out to the far side.
Grid MirrorGrid(const Direction& wo, double alpha) {
  std::vector<double> edges = {0};
  for (const double r : {0.2, 0.4, 0.6, 0.8, 1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0})
    edges.push_back(r * alpha);
  for (double angle = 16 * alpha; angle < 0.8; angle *= 1.6) edges.push_back(angle);
  edges.push_back(kPi);
  return MakeGrid({-wo.x, -wo.y, wo.z}, edges, 16);
}

/// Chi-squared of samples against masses; one more cell holds what fell outside or was invalid. The
/// far cell of `pool_last` rings is pooled there too, where midpoints do not integrate well.
double SampleTest(const Grid& grid, const Columns& wi, const std::vector<double>* valid,
                  std::vector<double> masses, size_t pool_last) {
  std::vector<double> counts(masses.size() + 1, 0);
  const size_t pooled_from = masses.size() - pool_last * grid.sectors;
  for (size_t i = 0; i < wi[0].size(); ++i) {
    const bool counted = valid == nullptr || (*valid)[i] != 0;
    const size_t cell = counted ? CellOf(grid, wi[0][i], wi[1][i], wi[2][i]) : masses.size();
    ++counts[cell < pooled_from ? cell : masses.size()];
  }
  double total = 0;
  for (size_t i = 0; i < masses.size(); ++i) {
    masses[i] = i < pooled_from ? masses[i] * wi[0].size() : 0;
    total += masses[i];
  }
  masses.push_back(std::max(0.0, wi[0].size() - total));
  return test::ChiSquaredTest(counts, masses);
}

Pdf PdfOf(const Surface& surface, const Direction& wo) {
  return [surface, wo](const Columns& wi) {
    Columns directions(3, std::vector<double>(wi[0].size()));
    std::fill(directions[0].begin(), directions[0].end(), wo.x);
    std::fill(directions[1].begin(), directions[1].end(), wo.y);
    std::fill(directions[2].begin(), directions[2].end(), wo.z);
    directions.insert(directions.end(), wi.begin(), wi.end());
    return ReferenceBsdfKernels().evaluate(surface, directions)[kValuePdf];
  };
}

/// The lobe is narrow across the plane of incidence at grazing angles.
int FineSteps(double mu) {
  return mu < 0.1 ? 48 : 12;
}

double MixtureTest(const Surface& drawn, const Surface& claimed, double mu, uint32_t seed,
                   bool around_mirror) {
  const Direction wo = OutgoingAt(mu);
  const double alpha = std::max(claimed.roughness * claimed.roughness, 1e-4);
  const Grid grid = around_mirror ? MirrorGrid(wo, alpha) : SphereGrid();
  const Columns out = BestBsdfKernels().sample(drawn, wo, IndependentUniforms(3, kCount, seed));
  const Columns wi(out.begin() + kSampleX, out.begin() + kSampleX + 3);
  const std::vector<double> masses =
      Masses(grid, PdfOf(claimed, wo), around_mirror ? 8 : FineSteps(mu));
  return SampleTest(grid, wi, &out[kValid], masses, around_mirror ? 1 : 0);
}

// Hard case 19.
TEST(BsdfSampling, MixtureFollowsItsDensityOverTheSphere) {
  uint32_t seed = 100;
  for (const double roughness : {0.4, 0.6, 1.0}) {
    for (const double mu : {0.04, 0.3, 0.9}) {
      for (const Surface& s : {WhiteMetal(roughness), Mixed(roughness)}) {
        EXPECT_GT(MixtureTest(s, s, mu, ++seed, false), test::kFalseAlarm)
            << s.name << ", mu " << mu << ", seed " << seed;
      }
    }
  }
}

TEST(BsdfSampling, MixtureFollowsItsDensityAroundTheMirror) {
  uint32_t seed = 200;
  for (const double roughness : {0.01, 0.03, 0.1, 0.2}) {
    for (const double mu : {0.3, 0.9}) {
      for (const Surface& s : {WhiteMetal(roughness), Mixed(roughness)}) {
        EXPECT_GT(MixtureTest(s, s, mu, ++seed, true), test::kFalseAlarm)
            << s.name << ", mu " << mu << ", seed " << seed;
      }
    }
  }
}

// Tests of the test: a wrong alpha or a wrong lobe probability must not pass.
TEST(BsdfSampling, ChiSquaredSeesWrongDensities) {
  Surface rougher = WhiteMetal(0.5);
  rougher.roughness = 0.505;
  EXPECT_LT(MixtureTest(WhiteMetal(0.5), rougher, 0.5, 300, false), test::kFalseAlarm);
  Surface sharper = WhiteMetal(0.03);
  sharper.roughness = 0.0306;
  EXPECT_LT(MixtureTest(WhiteMetal(0.03), sharper, 0.5, 301, true), test::kFalseAlarm);
  Surface denser = WhiteDielectric(0.5);
  denser.ior = 1.62;
  EXPECT_LT(MixtureTest(WhiteDielectric(0.5), denser, 0.5, 302, false), test::kFalseAlarm);
}

TEST(BsdfSampling, VisibleNormalsFollowTheirDensityOverTheWholeSphere) {
  uint32_t seed = 400;
  for (const double alpha : {0.25, 0.5, 1.0}) {
    for (const double mu : {0.05, 0.4, 1.0}) {
      const Direction wo = OutgoingAt(mu);
      const Grid grid = SphereGrid();
      const Columns out =
          BestBsdfKernels().visible(alpha, wo, IndependentUniforms(2, kCount, ++seed));
      const Pdf pdf = [&](const Columns& wi) {
        return ReferenceBsdfKernels().visible_pdf(alpha, wo, wi);
      };
      const Columns wi(out.begin(), out.begin() + 3);
      EXPECT_GT(SampleTest(grid, wi, nullptr, Masses(grid, pdf, FineSteps(mu)), 0),
                test::kFalseAlarm)
          << "alpha " << alpha << ", mu " << mu << ", seed " << seed;
    }
  }
}

/// A round light around the mirror direction, `radius` from its centre: f cos integrated over it.
struct LightEstimates {
  test::Mean light, bsdf;
};
constexpr size_t kLightCount = 1 << 17;

LightEstimates EstimateLight(const Surface& surface, double mu, double radius, uint32_t seed) {
  const Direction wo = OutgoingAt(mu);
  const Grid frame = MakeGrid({-wo.x, -wo.y, wo.z}, {0, radius, kPi}, 1);
  const double solid_angle = 4 * kPi * std::pow(std::sin(radius / 2), 2);
  LightEstimates estimates;

  const Columns u = IndependentUniforms(3, kLightCount, seed);
  Columns directions(6, std::vector<double>(kLightCount));
  for (size_t i = 0; i < kLightCount; ++i) {
    const double half = std::sin(radius / 2) * std::sqrt(u[0][i]);  // sine of half the polar angle
    const double cosine = 1 - 2 * half * half, sine = 2 * half * std::sqrt(1 - half * half),
                 turn = 2 * kPi * u[1][i];
    const double a = sine * std::cos(turn), b = sine * std::sin(turn);
    const double wi[] = {a * frame.tangent.x + b * frame.bitangent.x + cosine * frame.axis.x,
                         a * frame.tangent.y + b * frame.bitangent.y + cosine * frame.axis.y,
                         a * frame.tangent.z + b * frame.bitangent.z + cosine * frame.axis.z};
    directions[0][i] = wo.x, directions[1][i] = wo.y, directions[2][i] = wo.z;
    for (int c = 0; c < 3; ++c) directions[3 + c][i] = static_cast<float>(wi[c]);
  }
  const Columns values = BestBsdfKernels().evaluate(surface, directions);
  for (const double f_cos : values[kValueG]) estimates.light.Add(f_cos * solid_angle);

  const Columns out =
      BestBsdfKernels().sample(surface, wo, IndependentUniforms(3, kLightCount, seed + 1));
  for (size_t i = 0; i < kLightCount; ++i) {
    const bool hit = CellOf(frame, out[kSampleX][i], out[kSampleY][i], out[kSampleZ][i]) == 0;
    estimates.bsdf.Add(hit ? out[kWeightG][i] : 0);
  }
  return estimates;
}

// Hard case 17.
TEST(BsdfSampling, LightSamplingEqualsBsdfSamplingAtSmallAlpha) {
  uint32_t seed = 500;
  for (const double alpha : {1e-4, 3e-4, 1e-3, 1e-2, 0.05}) {
    for (const double mu : {0.2, 0.7, 1.0}) {
      for (const Surface& s : {WhiteMetal(std::sqrt(alpha)), Mixed(std::sqrt(alpha))}) {
        const LightEstimates e = EstimateLight(s, mu, 3 * alpha, seed += 2);
        const double z =
            (e.light.Value() - e.bsdf.Value()) / std::hypot(e.light.Error(), e.bsdf.Error());
        EXPECT_GT(test::NormalTail(z), test::kFalseAlarm)
            << s.name << ", mu " << mu << ": light " << e.light.Value() << " +- " << e.light.Error()
            << ", BSDF " << e.bsdf.Value() << " +- " << e.bsdf.Error();
        EXPECT_LT(e.light.Error(), 0.01 * e.light.Value());
      }
    }
  }
}

}  // namespace
}  // namespace carpool::tests
