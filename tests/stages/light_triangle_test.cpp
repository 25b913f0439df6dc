// Sampling a triangle light: unbiased for every solid angle, and its density found again
// (HARD_CASES 25, 26, 29).
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/stages/light_harness.h"
#include "tests/support/statistics.h"

namespace carpool::stages {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr float kLargestBelowOne = 0x1.fffffep-1f;

using V = std::array<double, 3>;
V operator-(const V& a, const V& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
V operator*(const V& a, double s) {
  return {a[0] * s, a[1] * s, a[2] * s};
}
V operator+(const V& a, const V& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
double Dot(const V& a, const V& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
V Cross(const V& a, const V& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
V Unit(const V& a) {
  return a * (1 / std::sqrt(Dot(a, a)));
}
V FromFloat(const float f[3]) {
  return {f[0], f[1], f[2]};
}

/// Lambert 1760: irradiance of a polygon of radiance 1 that lies above the horizon of `normal`.
double LambertIrradiance(const V p[3], const V& ref, const V& normal) {
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    const V a = Unit(p[i] - ref), b = Unit(p[(i + 1) % 3] - ref);
    const V axis = Cross(a, b);
    const double length = std::sqrt(Dot(axis, axis));
    if (length > 0) sum += std::atan2(length, Dot(a, b)) * Dot(axis, normal) / length;
  }
  return std::abs(sum) / 2;
}

double SolidAngle(const V p[3], const V& ref) {
  const V a = Unit(p[0] - ref), b = Unit(p[1] - ref), c = Unit(p[2] - ref);
  return 2 * std::atan2(std::abs(Dot(a, Cross(b, c))), 1 + Dot(a, b) + Dot(b, c) + Dot(c, a));
}

/// A triangle and a receiver, both exactly as the kernel gets them.
struct Case {
  V p[3];
  V ref, normal;
  LightQuery query;

  Case(const V& p0, const V& p1, const V& p2, const V& receiver, const V& n) {
    const V* given[3] = {&p0, &p1, &p2};
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) query.p[3 * i + k] = static_cast<float>((*given[i])[k]);
      p[i] = FromFloat(&query.p[3 * i]);
      query.position[i] = static_cast<float>(receiver[i]);
    }
    ref = FromFloat(query.position);
    normal = Unit(n);
  }
};

std::vector<LightQuery> WithRandomNumbers(const LightQuery& query, size_t count, uint32_t seed) {
  std::mt19937 rng(seed);
  std::vector<LightQuery> queries(count, query);
  for (LightQuery& q : queries) {
    for (float& u : q.u) u = static_cast<float>(rng() >> 8) * 0x1p-24f;
  }
  return queries;
}

/// A unit triangle of some shape at a height over the receiver, which faces it.
Case AtHeight(double height, double shift, double aspect) {
  return Case({-1, -0.6 * aspect, height}, {1.1, -0.5 * aspect, height},
              {0.1, 0.9 * aspect, height}, {shift, 0, 0}, {0, 0, 1});
}

std::vector<Case> CasesOfAllSolidAngles() {
  std::vector<Case> cases;
  for (const double aspect : {1.0, 0.02}) {
    for (const double shift : {0.0, 0.9, -3.0}) {
      for (double height = 3e-4; height < 4000; height *= 1.6) {
        cases.push_back(AtHeight(height, shift, aspect));
      }
    }
  }
  // Across both switches of method, in small steps.
  for (int i = -10; i <= 10; ++i) {
    cases.push_back(AtHeight(60.5 * (1 + 0.004 * i), 0.1, 1));
    cases.push_back(AtHeight(0.0095 * (1 + 0.05 * i), 0.1, 1));
  }
  // Seen edge on, tilted by ever less, from beside the triangle.
  for (const double tilt : {1.0, 0.1, 1e-2, 1e-3}) {
    const double s = std::sin(tilt), c = std::cos(tilt);
    cases.push_back(
        Case({1, -1, 0.0}, {1, 1, 0.0}, {1 + 2 * c, 0.2, 2 * s}, {0, 0, 0}, {1, 0, 0.2}));
  }
  return cases;
}

TEST(LightTriangle, MeanIsLambertsFormula) {
  double least = 10, greatest = 0;
  for (const LightRunner& runner : AllLightRunners()) {
    if (runner.name.ends_with("x1")) continue;  // the same bits: WidthDoesNotMatter
    for (const Case& c : CasesOfAllSolidAngles()) {
      const double omega = SolidAngle(c.p, c.ref);
      least = std::min(least, omega);
      greatest = std::max(greatest, omega);
      test::Mean irradiance, solid_angle;
      for (const LightResult& r :
           runner.run(LightKernel::sample_triangle, {}, WithRandomNumbers(c.query, 20000, 21))) {
        const double inverse = r.pdf > 0 ? 1 / r.pdf : 0.0;
        irradiance.Add(std::max(0.0, Dot(FromFloat(r.wi), c.normal)) * inverse);
        solid_angle.Add(inverse);
      }
      // Rounding: of the inputs' difference where the receiver all but lies in the plane.
      EXPECT_LT(irradiance.Z(LambertIrradiance(c.p, c.ref, c.normal), 4e-5), test::kLargestZ)
          << runner.name << " seen under " << omega << " got " << irradiance.Value() << " for "
          << LambertIrradiance(c.p, c.ref, c.normal);
      EXPECT_LT(solid_angle.Z(omega, 4e-5), test::kLargestZ)
          << runner.name << " seen under " << omega << " got " << solid_angle.Value();
    }
  }
  EXPECT_LT(least, 1e-6);
  EXPECT_GT(greatest, 6.28);
}

TEST(LightTriangle, SquareAtHeightOne) {
  const Case lower({-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {0, 0, 0}, {0, 0, 1});
  const Case upper({-1, -1, 1}, {1, 1, 1}, {-1, 1, 1}, {0, 0, 0}, {0, 0, 1});
  test::Mean irradiance;
  const auto a = BestLightRunner().run(LightKernel::sample_triangle, {},
                                       WithRandomNumbers(lower.query, 400000, 22));
  const auto b = BestLightRunner().run(LightKernel::sample_triangle, {},
                                       WithRandomNumbers(upper.query, 400000, 23));
  for (size_t i = 0; i < a.size(); ++i) {
    irradiance.Add(a[i].wi[2] / a[i].pdf + b[i].wi[2] / b[i].pdf);
  }
  // The figure of HARD_CASES 26; its own rounding is 5e-6.
  EXPECT_LT(irradiance.Z(0.55413 * kPi, 1e-5), test::kLargestZ) << irradiance.Value() / kPi;
}

/// Splits barycentric space into 4^3 triangles and compares counts with their exact solid angles.
TEST(LightTriangle, PointsAreUniformOverTheSolidAngle) {
  constexpr int kDivisions = 8;
  constexpr size_t kSamples = 200000;
  for (const Case& c : {AtHeight(0.1, 0, 1), AtHeight(1, 0.9, 1), AtHeight(20, -3, 0.02),
                        AtHeight(0.05, -1.5, 1)}) {
    const double omega = SolidAngle(c.p, c.ref);
    const auto point = [&](double b1, double b2) {
      return c.p[0] * (1 - b1 - b2) + c.p[1] * b1 + c.p[2] * b2;
    };
    std::vector<double> expected(2 * kDivisions * kDivisions), counts(expected.size());
    const double h = 1.0 / kDivisions;
    for (int i = 0; i < kDivisions; ++i) {
      for (int j = 0; i + j < kDivisions; ++j) {
        const V lower[3] = {point(i * h, j * h), point((i + 1) * h, j * h),
                            point(i * h, (j + 1) * h)};
        const V upper[3] = {point((i + 1) * h, (j + 1) * h), lower[1], lower[2]};
        const size_t at = 2ul * (i * kDivisions + j);
        expected[at] = SolidAngle(lower, c.ref) / omega * kSamples;
        if (i + j + 1 < kDivisions) expected[at + 1] = SolidAngle(upper, c.ref) / omega * kSamples;
      }
    }
    for (const LightResult& r : BestLightRunner().run(LightKernel::sample_triangle, {},
                                                      WithRandomNumbers(c.query, kSamples, 24))) {
      const double x = r.b[0] * kDivisions, y = r.b[1] * kDivisions;
      const int i = std::min(static_cast<int>(x), kDivisions - 1);
      const int j = std::min(static_cast<int>(y), kDivisions - 1 - i);
      const bool upper = (x - i) + (y - j) > 1 && i + j + 1 < kDivisions;
      ++counts[2ul * (i * kDivisions + j) + upper];
    }
    EXPECT_GT(test::ChiSquaredTest(counts, expected), test::kFalseAlarm) << "seen under " << omega;
  }
}

TEST(LightTriangle, DensityIsFoundAgainFromTheHit) {
  for (const LightRunner& runner : AllLightRunners()) {
    for (const Case& c : CasesOfAllSolidAngles()) {
      const auto samples =
          runner.run(LightKernel::sample_triangle, {}, WithRandomNumbers(c.query, 64, 25));
      std::vector<LightQuery> hits(samples.size(), c.query);
      for (size_t i = 0; i < samples.size(); ++i) {
        std::copy(samples[i].wi, samples[i].wi + 3, hits[i].dir);
        hits[i].distance = samples[i].distance;
      }
      const auto found = runner.run(LightKernel::triangle_pdf, {}, hits);
      for (size_t i = 0; i < samples.size(); ++i) {
        if (samples[i].pdf > 0) {
          ASSERT_NEAR(found[i].pdf / samples[i].pdf, 1, 1e-5) << runner.name;
        }
      }
    }
  }
}

TEST(LightTriangle, DirectionAndDistanceLeadToThePoint) {
  for (const LightRunner& runner : AllLightRunners()) {
    for (const Case& c : CasesOfAllSolidAngles()) {
      for (const LightResult& r :
           runner.run(LightKernel::sample_triangle, {}, WithRandomNumbers(c.query, 64, 26))) {
        if (r.pdf == 0) continue;
        const V to = c.p[0] * (1.0 - r.b[0] - r.b[1]) + c.p[1] * r.b[0] + c.p[2] * r.b[1] - c.ref;
        const V off = FromFloat(r.wi) * r.distance - to;
        ASSERT_GE(r.b[0], 0);
        ASSERT_GE(r.b[1], 0);
        ASSERT_LE(r.b[0] + r.b[1], 1.0f + 0x1p-23f);
        ASSERT_LT(std::sqrt(Dot(off, off)), 1e-6 * (1 + std::sqrt(Dot(to, to)))) << runner.name;
      }
    }
  }
}

TEST(LightTriangle, ReceiverOnTheLightGetsFiniteNumbers) {
  const V p0 = {-1, -0.6, 0}, p1 = {1.1, -0.5, 0}, p2 = {0.1, 0.9, 0};
  std::vector<V> receivers = {
      p0, p1, p2, p0 * 0.5 + p1 * 0.5, p0 * 0.3 + p1 * 0.3 + p2 * 0.4, p1 * 2 + p0 * -1};
  for (const double height : {0.0, 1e-30, 1e-12, 1e-7, 1e-4}) {
    for (const V& at : receivers) {
      Case c(p0, p1, p2, {at[0], at[1], height}, {0, 0, 1});
      auto queries = WithRandomNumbers(c.query, 256, 27);
      size_t i = 0;
      for (const float x : {0.0f, 0.5f, kLargestBelowOne}) {
        for (const float y : {0.0f, 0.5f, kLargestBelowOne}) {
          queries[i].u[0] = x;
          queries[i++].u[1] = y;
        }
      }
      for (const LightRunner& runner : AllLightRunners()) {
        for (const LightResult& r : runner.run(LightKernel::sample_triangle, {}, queries)) {
          ASSERT_TRUE(std::isfinite(r.pdf) && r.pdf >= 0) << runner.name << height;
          if (r.pdf == 0) continue;
          ASSERT_TRUE(std::isfinite(r.distance) && r.distance > 0) << runner.name << height;
          ASSERT_NEAR(std::hypot(r.wi[0], r.wi[1], r.wi[2]), 1, 1e-6) << runner.name << height;
        }
      }
    }
  }
}

TEST(LightTriangle, ADegenerateTriangleGivesNoSample) {
  const Case needle({0, 0, 1}, {1, 0, 1}, {2, 0, 1}, {0, 0, 0}, {0, 0, 1});
  const Case point({1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {0, 0, 0}, {0, 0, 1});
  for (const LightRunner& runner : AllLightRunners()) {
    for (const Case& c : {needle, point}) {
      for (const LightResult& r :
           runner.run(LightKernel::sample_triangle, {}, WithRandomNumbers(c.query, 64, 28))) {
        EXPECT_EQ(r.pdf, 0) << runner.name;
      }
    }
  }
}

TEST(LightTriangle, WidthDoesNotMatter) {
  const auto runners = AllLightRunners();
  std::vector<LightQuery> queries;
  for (const Case& c : CasesOfAllSolidAngles()) {
    for (const LightQuery& q : WithRandomNumbers(c.query, 11, 29)) queries.push_back(q);
  }
  for (size_t i = 0; i + 1 < runners.size(); i += 2) {
    EXPECT_EQ(runners[i].run(LightKernel::sample_triangle, {}, queries),
              runners[i + 1].run(LightKernel::sample_triangle, {}, queries))
        << runners[i].target;
  }
}

}  // namespace
}  // namespace carpool::stages
