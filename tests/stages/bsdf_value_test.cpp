// Values of the BSDF: closed forms, reciprocity, extremes, and the same bits at every width.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "stages/simd/denormals.h"
#include "tests/stages/bsdf_directions.h"

namespace carpool::tests {
namespace {

Columns FresnelAt(const BsdfKernels& kernels, std::vector<std::array<double, 3>> arguments) {
  Columns in(3);
  while (arguments.size() % 64 != 0) arguments.push_back(arguments.back());
  for (const auto& a : arguments) {
    for (int c = 0; c < 3; ++c) in[c].push_back(a[c]);
  }
  return kernels.fresnel(in);
}

// Hard case 21.
TEST(Fresnel, KnownValues) {
  const double cos45 = std::sqrt(0.5);
  for (const BsdfKernels& kernels : AllBsdfKernels()) {
    SCOPED_TRACE(kernels.name);
    const Columns r = FresnelAt(
        kernels, {{1, 1.5, 0}, {cos45, 1.5, 0}, {0.3, 1, 0}, {0.5, 1 / 1.5, 0}, {0, 1.5, 0}});
    EXPECT_NEAR(r[kDielectric][0], 0.04, 1e-7);
    EXPECT_NEAR(r[kDielectric][1], 0.05024, 1e-5);
    EXPECT_NEAR(r[kDielectric][2], 0, 1e-7);
    EXPECT_EQ(r[kDielectric][3], 1) << "total internal reflection";
    EXPECT_EQ(r[kDielectric][4], 1) << "grazing";
    EXPECT_NEAR(r[kSchlick][0], 0.04, 1e-7);
    EXPECT_EQ(r[kSchlick][2], 0) << "no interface at ior 1";
  }
}

TEST(Fresnel, ConductorWithoutAbsorptionIsTheDielectric) {
  std::vector<std::array<double, 3>> arguments;
  for (int i = 0; i <= 64; ++i) arguments.push_back({i / 64.0, 1.1 + i % 7 * 0.3, 0});
  const Columns r = FresnelAt(ReferenceBsdfKernels(), arguments);
  for (size_t i = 0; i < arguments.size(); ++i)
    EXPECT_NEAR(r[kConductor][i], r[kDielectric][i], 1e-12);
  const Columns f = FresnelAt(BestBsdfKernels(), arguments);
  for (size_t i = 0; i < arguments.size(); ++i)
    EXPECT_NEAR(f[kConductor][i], f[kDielectric][i], 2e-5);
}

TEST(Fresnel, DiffuseMeans) {
  const auto mean = [](double ior, FresnelColumn column) {
    std::vector<std::array<double, 3>> arguments;
    for (int i = 0; i < 1 << 14; ++i)
      arguments.push_back({std::sqrt((i + 0.5) / (1 << 14)), ior, 0});
    const Columns r = FresnelAt(ReferenceBsdfKernels(), arguments);
    double sum = 0;
    for (const double value : r[column]) sum += value;
    return sum / r[column].size();
  };
  EXPECT_NEAR(mean(1.5, kDielectric), 0.09178, 2e-5);
  for (const double ior : {1.0, 1.05, 1.2, 1.33, 1.5, 2.4}) {
    const Columns closed = FresnelAt(ReferenceBsdfKernels(), {{1, ior, 0}});
    EXPECT_NEAR(mean(ior, kSchlick), closed[kSchlickMean][0], 1e-5) << ior;
    // What Schlick's term costs; 0.006 at ior 1.5.
    EXPECT_NEAR(mean(ior, kSchlick), mean(ior, kDielectric), 0.0085) << ior;
  }
}

Columns Evaluate(const BsdfKernels& kernels, const Surface& surface, const Columns& wo,
                 const Columns& wi) {
  Columns directions = wo;
  directions.insert(directions.end(), wi.begin(), wi.end());
  return kernels.evaluate(surface, directions);
}

// Hard case 20.
TEST(Bsdf, IsReciprocal) {
  const Columns a = RandomHemisphere(4096, 1), b = RandomHemisphere(4096, 2);
  for (const double roughness : {0.0, 0.03, 0.1, 0.3, 0.6, 1.0}) {
    for (const Surface& s : {WhiteDielectric(roughness), WhiteMetal(roughness), Mixed(roughness)}) {
      const Columns forth = Evaluate(BestBsdfKernels(), s, a, b),
                    back = Evaluate(BestBsdfKernels(), s, b, a);
      for (size_t i = 0; i < 4096; ++i) {
        for (int c = 0; c < 3; ++c) {
          const double f = forth[c][i] / b[2][i], g = back[c][i] / a[2][i];
          ASSERT_NEAR(f, g, 1e-4 * std::max(f, g) + 1e-30)
              << s.name << " " << a[2][i] << " " << b[2][i];
        }
      }
    }
  }
}

// Hard case 11: without an interface, every sample of a diffuse surface weighs rho; two roundings.
TEST(Bsdf, LambertWeighsRho) {
  Surface s;
  s.name = "Lambert";
  s.specular = 0;
  s.base[0] = 0.25f, s.base[1] = 0.7f, s.base[2] = 1;
  const Columns u = IndependentUniforms(3, 4096, 5);
  for (const BsdfKernels& kernels : AllBsdfKernels()) {
    SCOPED_TRACE(kernels.name);
    const Columns out = kernels.sample(s, OutgoingAt(0.4), u);
    for (size_t i = 0; i < 4096; ++i) {
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(out[kWeightR + c][i], s.base[c], s.base[c] * 0x1p-22);
      ASSERT_NEAR(out[kSamplePdf][i], out[kSampleZ][i] / std::numbers::pi, 2e-7);
    }
  }
}

// Hard case 23.
TEST(Bsdf, IorOneIsNoInterfaceAndIorZeroReflectsAll) {
  const Columns wo = RandomHemisphere(1024, 3), wi = RandomHemisphere(1024, 4);
  Surface none = WhiteDielectric(0.4), lambert = WhiteDielectric(0.4), all = WhiteDielectric(0.4);
  none.ior = 1;
  lambert.specular = 0;
  all.ior_zero = true;
  const Columns a = Evaluate(BestBsdfKernels(), none, wo, wi),
                b = Evaluate(BestBsdfKernels(), lambert, wo, wi);
  const Columns c = Evaluate(BestBsdfKernels(), all, wo, wi),
                d = Evaluate(BestBsdfKernels(), WhiteMetal(0.4), wo, wi);
  for (size_t i = 0; i < 1024; ++i) {
    ASSERT_EQ(a[kValueG][i], b[kValueG][i]);
    ASSERT_NEAR(a[kValueG][i], wi[2][i] / std::numbers::pi, 1e-6);
    ASSERT_NEAR(c[kValueG][i], d[kValueG][i], 1e-5 * d[kValueG][i]);
  }
}

// Hard case 24.
TEST(Bsdf, BlackIsBlackWithoutNan) {
  Surface black_metal = WhiteMetal(0.3), black = WhiteDielectric(0.3);
  for (double& c : black.base) c = 0;
  black.specular = 0;
  for (double& c : black_metal.base) c = 0;
  const Columns u = IndependentUniforms(3, 1024, 6);
  for (const BsdfKernels& kernels : AllBsdfKernels()) {
    SCOPED_TRACE(kernels.name);
    const Columns out = kernels.sample(black, OutgoingAt(0.4), u);
    for (size_t i = 0; i < 1024; ++i) {
      ASSERT_EQ(out[kValid][i], 0);
      ASSERT_EQ(out[kSamplePdf][i], 0);
      for (int c = 0; c < 3; ++c) ASSERT_EQ(out[kWeightR + c][i], 0);
    }
    // A black metal still mirrors at grazing angles (F90 is 1), and stays finite.
    const Columns grazing = kernels.sample(black_metal, OutgoingAt(0.05), u);
    for (const double weight : grazing[kWeightR]) {
      ASSERT_TRUE(std::isfinite(weight) && weight >= 0 && weight < 16);
    }
  }
}

/// Both denormal settings: kernels run with denormals flushed.
void ExpectFiniteExtremes() {
  Columns wo(3), wi(3);
  const double cosines[] = {1e-38, 1e-20, 1e-10, 1e-7, 1e-4, 0.01, 0.5, 1};
  for (int i = 0; i < 64; ++i) {
    for (const bool opposite : {true, false}) {
      const Direction a = OutgoingAt(cosines[i % 8]), b = OutgoingAt(cosines[i / 8]);
      const double sign = opposite ? -1 : 1;
      const double columns[] = {a.x, a.y, a.z, sign * b.x, sign * b.y, b.z};
      for (int c = 0; c < 3; ++c) wo[c].push_back(columns[c]), wi[c].push_back(columns[3 + c]);
    }
  }
  Columns u(3);
  for (int i = 0; i < 64; ++i) {
    constexpr double kEdge[] = {0, 0x1p-24, 0.5, 1 - 0x1p-24};
    u[0].push_back(kEdge[i % 4]), u[1].push_back(kEdge[i / 4 % 4]), u[2].push_back(kEdge[i / 16]);
  }
  for (const BsdfKernels& kernels : AllBsdfKernels()) {
    SCOPED_TRACE(kernels.name);
    for (const double roughness : {0.0, 0.01, 0.1, 1.0, -3.0, 7.0}) {
      for (const Surface& s :
           {WhiteDielectric(roughness), WhiteMetal(roughness), Mixed(roughness)}) {
        for (const auto& column : Evaluate(kernels, s, wo, wi)) {
          for (const double x : column)
            ASSERT_TRUE(std::isfinite(x) && x >= 0) << s.name << " " << x;
        }
        for (const double mu : cosines) {
          const Columns out = kernels.sample(s, OutgoingAt(mu), u);
          for (size_t i = 0; i < 64; ++i) {
            for (const auto& column : out)
              ASSERT_TRUE(std::isfinite(column[i])) << s.name << " mu " << mu;
            ASSERT_NEAR(std::hypot(out[kSampleX][i], out[kSampleY][i], out[kSampleZ][i]), 1, 1e-6);
            // pdf^2 must not overflow in the power heuristic.
            ASSERT_LT(out[kSamplePdf][i], 1e18);
            ASSERT_EQ(out[kValid][i] != 0, out[kSamplePdf][i] > 0);
          }
        }
      }
    }
  }
}

TEST(Bsdf, ExtremesAreFinite) {
  ExpectFiniteExtremes();
  const stages::FlushDenormals flush;
  ExpectFiniteExtremes();
}

// Hard case 31, for lobes: the ends of [0, 1) never choose a lobe of weight zero, and always choose
// some lobe.
TEST(Bsdf, EndsOfTheUnitIntervalChooseARealLobe) {
  Surface lambert = WhiteDielectric(0.3);
  lambert.specular = 0;
  Columns u = IndependentUniforms(3, 1024, 14);
  for (const BsdfKernels& kernels : AllBsdfKernels()) {
    SCOPED_TRACE(kernels.name);
    for (const double end : {0.0, 1 - 0x1p-24}) {
      u[0].assign(1024, end);
      const Columns diffuse = kernels.sample(lambert, OutgoingAt(0.7), u);
      const Columns metal = kernels.sample(WhiteMetal(0.1), OutgoingAt(0.7), u);
      for (size_t i = 0; i < 1024; ++i) {
        ASSERT_EQ(diffuse[kValid][i], 1) << end;
        ASSERT_EQ(metal[kValid][i], 1) << end;
      }
    }
  }
}

TEST(Bsdf, BelowTheSurfaceIsZero) {
  const Columns wo = RandomHemisphere(64, 8);
  Columns wi = RandomHemisphere(64, 9);
  for (double& z : wi[2]) z = -z;
  wi[2][0] = 0, wi[2][1] = -0.0;
  for (const auto& column : Evaluate(BestBsdfKernels(), Mixed(0.4), wo, wi)) {
    for (const double x : column) ASSERT_EQ(x, 0);
  }
}

// Hard case 18: below the smallest roughness nothing changes, and just above it little does.
TEST(Bsdf, JoinsTheMirrorContinuously) {
  const Columns u = IndependentUniforms(3, 1024, 10);
  const Direction wo = OutgoingAt(0.5);
  const Columns mirror = BestBsdfKernels().sample(WhiteMetal(0), wo, u);
  EXPECT_TRUE(mirror == BestBsdfKernels().sample(WhiteMetal(0.0099), wo, u));
  for (size_t i = 0; i < 1024; ++i) {
    ASSERT_NEAR(mirror[kSampleX][i] + wo.x, 0, 0.02);
    ASSERT_NEAR(mirror[kWeightR][i], 1, 1e-3);
  }
}

// One source for every width: the same bits in a lane whatever its neighbours, in each instruction
// set.
TEST(Bsdf, OneLaneIsNLanesAndDoubleIsClose) {
  const Columns u = IndependentUniforms(3, 4096, 11);
  const Columns wo = RandomHemisphere(4096, 12), wi = RandomHemisphere(4096, 13);
  const auto& all = AllBsdfKernels();
  ASSERT_EQ(all.size() % 3, 0u);
  for (size_t k = 0; k < all.size(); k += 3) {
    SCOPED_TRACE(all[k].name);
    for (const double roughness : {0.0, 0.2, 0.6, 1.0}) {
      for (const double mu : {0.02, 0.3, 0.95}) {
        const Surface s = Mixed(roughness);
        const Columns wide = all[k].sample(s, OutgoingAt(mu), u);
        ASSERT_TRUE(wide == all[k + 1].sample(s, OutgoingAt(mu), u)) << s.name << " mu " << mu;
        const Columns reference = all[k + 2].sample(s, OutgoingAt(mu), u);
        size_t different = 0;
        for (size_t i = 0; i < 4096; ++i) {
          // The same lobe and direction; a lobe choice may fall to the other side of its threshold.
          different += std::abs(wide[kSampleX][i] - reference[kSampleX][i]) > 1e-3 ||
                       std::abs(wide[kWeightR][i] - reference[kWeightR][i]) >
                           0.02 * (1 + reference[kWeightR][i]);
        }
        EXPECT_LE(different, 8u) << s.name << " mu " << mu;
      }
      const Surface s = Mixed(roughness);
      const Columns wide = Evaluate(all[k], s, wo, wi);
      ASSERT_TRUE(wide == Evaluate(all[k + 1], s, wo, wi)) << s.name;
      const Columns reference = Evaluate(all[k + 2], s, wo, wi);
      // A half-vector in float moves D's argument by an ulp over alpha.
      const double tolerance = 2e-4 + 3e-7 / std::max(roughness * roughness, 1e-4);
      for (int c = 0; c < kValueColumns; ++c) {
        for (size_t i = 0; i < 4096; ++i) {
          ASSERT_NEAR(wide[c][i], reference[c][i], tolerance * reference[c][i] + 1e-9) << s.name;
        }
      }
    }
  }
}

}  // namespace
}  // namespace carpool::tests
