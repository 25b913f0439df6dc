// The guarded helpers of stages/simd/lanes-inl.h against double, at the edges of their ranges.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "tests/stages/sampling_kernels.h"

namespace carpool::tests {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Half an ulp of float around `value`.
double HalfUlp(double value) {
  return std::max(std::abs(value) * 0x1p-24, 1e-45);
}

/// Unit normals: the poles with both signs of zero, near-poles, and random directions.
Columns Normals(size_t count, uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Columns n(3);
  const auto add = [&](double x, double y, double z) {
    const double length = std::sqrt(x * x + y * y + z * z);
    n[0].push_back(static_cast<float>(x / length));
    n[1].push_back(static_cast<float>(y / length));
    n[2].push_back(static_cast<float>(z / length));
  };
  for (const double pole : {1.0, -1.0}) {
    for (const double x : {0.0, -0.0}) add(x, 0.0, pole), add(x, -0.0, pole);
    for (int e = 1; e < 46; ++e) add(std::ldexp(1.0, -e), -std::ldexp(0.7, -e), pole);
  }
  for (const double zero : {0.0, -0.0})
    add(1, 0, zero), add(0, 1, zero), add(-1, 0, zero), add(0.6, -0.8, zero);
  for (int e = 1; e < 120; e += 7) add(0.6, 0.8, -std::ldexp(1.0, -e));
  while (n[0].size() < count) add(normal(random), normal(random), normal(random));
  return n;
}

double Dot(const Columns& a, size_t ka, const Columns& b, size_t kb, size_t i) {
  return a[ka][i] * b[kb][i] + a[ka + 1][i] * b[kb + 1][i] + a[ka + 2][i] * b[kb + 2][i];
}

// Hard case 9.
TEST(Numerics, FrameIsOrthonormalFromPoleToPole) {
  for (const SamplingKernels& kernels : AllSamplingKernels()) {
    SCOPED_TRACE(kernels.name);
    double worst = 0;
    const size_t rounds = &kernels == &AllSamplingKernels().front() ? 153 : 1;  // 1e7 normals
    for (size_t round = 0; round < rounds; ++round) {
      const Columns n = Normals(1 << 16, static_cast<uint32_t>(round));
      const Columns frame = kernels.frame(n);
      for (size_t i = 0; i < n[0].size(); ++i) {
        const double handed = n[0][i] * (frame[1][i] * frame[5][i] - frame[2][i] * frame[4][i]) +
                              n[1][i] * (frame[2][i] * frame[3][i] - frame[0][i] * frame[5][i]) +
                              n[2][i] * (frame[0][i] * frame[4][i] - frame[1][i] * frame[3][i]);
        const double errors[] = {Dot(frame, 0, frame, 3, i),     Dot(frame, 0, n, 0, i),
                                 Dot(frame, 3, n, 0, i),         Dot(frame, 0, frame, 0, i) - 1,
                                 Dot(frame, 3, frame, 3, i) - 1, handed - 1};
        for (const double error : errors) {
          ASSERT_LE(std::abs(error), 1e-6) << n[0][i] << " " << n[1][i] << " " << n[2][i];
          worst = std::max(worst, std::abs(error));
        }
      }
    }
    RecordProperty("worst " + kernels.name, std::to_string(worst));
  }
}

TEST(Numerics, SafeSqrtIsSqrtAboveZeroAndZeroElsewhere) {
  std::vector<double> x = {0, -0.0, -1e-30, -1,   -kInfinity, kNan,
                           1, 4,    1e-30,  1e30, 3e38,       kInfinity};
  while (x.size() < 1024) x.push_back(static_cast<float>(std::exp2(-120 + 0.24 * x.size())));
  for (const SamplingKernels& kernels : AllSamplingKernels()) {
    SCOPED_TRACE(kernels.name);
    const Columns result = kernels.safe_sqrt({x});
    for (size_t i = 0; i < x.size(); ++i) {
      const double expected = x[i] > 0 ? std::sqrt(x[i]) : 0;
      if (std::isinf(expected)) {
        EXPECT_EQ(result[0][i], expected);
      } else {
        EXPECT_NEAR(result[0][i], expected, HalfUlp(expected)) << x[i];
      }
    }
  }
}

TEST(Numerics, SafeDivIsZeroForDenominatorsNotAboveZero) {
  Columns in(2);
  for (const double a : {0.0, 1.0, -3.0, 1e30, 1e-30, kInfinity, kNan, 7.0}) {
    for (const double b : {0.0, -0.0, -2.0, kNan, 3.0, 1e-30, 1e20, -kInfinity}) {
      in[0].push_back(static_cast<float>(a));
      in[1].push_back(static_cast<float>(b));
    }
  }
  for (const SamplingKernels& kernels : AllSamplingKernels()) {
    SCOPED_TRACE(kernels.name);
    const Columns result = kernels.safe_div(in);
    for (size_t i = 0; i < in[0].size(); ++i) {
      const double a = in[0][i], b = in[1][i];
      double expected = b > 0 ? a / b : 0;
      if (!kernels.is_double && std::abs(expected) > std::numeric_limits<float>::max())
        expected = std::copysign(kInfinity, expected);
      if (std::isfinite(expected)) {
        EXPECT_NEAR(result[0][i], expected, HalfUlp(expected)) << a << " / " << b;
      } else if (std::isnan(expected)) {
        EXPECT_TRUE(std::isnan(result[0][i])) << a << " / " << b;
      } else {
        EXPECT_EQ(result[0][i], expected) << a << " / " << b;
      }
    }
  }
}

TEST(Numerics, SafeNormalizeHoldsOverTheWholeRange) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  Columns in(3);
  const auto add = [&](double x, double y, double z) {
    in[0].push_back(static_cast<float>(x));
    in[1].push_back(static_cast<float>(y));
    in[2].push_back(static_cast<float>(z));
  };
  add(0, 0, 0), add(-0.0, 0, 0), add(0, 1, kNan), add(kInfinity, 0, 0), add(0, -kInfinity, 1);
  add(kNan, 1, 0), add(1, kNan, 0);
  const size_t bad = in[0].size();
  add(9e36, 9e36, 9e36), add(2e-37, 0, 0), add(1, 1e-30, 0), add(0, 0, -5);
  while (in[0].size() < 4096) {
    const double scale = std::exp2(-119 + 238.0 * in[0].size() / 4096);
    add(scale * normal(random), scale * normal(random), scale * (normal(random) + 4));
  }
  for (const SamplingKernels& kernels : AllSamplingKernels()) {
    SCOPED_TRACE(kernels.name);
    const Columns out = kernels.safe_normalize(in);
    for (size_t i = 0; i < in[0].size(); ++i) {
      const double x = in[0][i], y = in[1][i], z = in[2][i];
      const double largest = std::max({std::abs(x), std::abs(y), std::abs(z)});
      if (i >= bad && !(largest > 1.01e-37 && largest < 0.99e37))
        continue;  // either answer is good at the limits
      const double length = std::sqrt(x * x + y * y + z * z);
      const double expected[] = {x / length, y / length, z / length};
      for (int axis = 0; axis < 3; ++axis) {
        const double fallback = axis == 2 ? 1 : 0;
        ASSERT_NEAR(out[axis][i], i < bad ? fallback : expected[axis], 3e-7)
            << x << " " << y << " " << z;
      }
    }
  }
}

}  // namespace
}  // namespace carpool::tests
