// The sampler: exact against a plain reference, stratified within a dimension, independent between
// them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>

#include "stages/sampling/dimensions.h"
#include "tests/stages/sampling_kernels.h"
#include "tests/support/statistics.h"

namespace carpool::tests {
namespace {

using stages::Purpose;

/// `count` draws of one pixel's scramble group: index 0, 1, 2, ...
Draws GroupDraws(uint32_t pixel, uint32_t group, uint32_t vertex, Purpose purpose, uint32_t count) {
  Draws draws;
  draws.purpose = purpose;
  for (uint32_t i = 0; i < count; ++i) {
    draws.pixel.push_back(pixel);
    draws.sample.push_back(i * stages::kScrambleGroups + group);
    draws.vertex.push_back(vertex);
    draws.iteration.push_back(0);
  }
  return draws;
}

/// One draw in each of `count` pixels, all with the same sample number.
Draws PixelDraws(uint32_t sample, uint32_t vertex, Purpose purpose, uint32_t count) {
  Draws draws = GroupDraws(0, 0, vertex, purpose, count);
  for (uint32_t i = 0; i < count; ++i) {
    draws.pixel[i] = i;
    draws.sample[i] = sample;
  }
  return draws;
}

// ---- A reference written from the definitions, bit by bit.

uint32_t Reverse(uint32_t x) {
  uint32_t result = 0;
  for (int bit = 0; bit < 32; ++bit) result |= ((x >> bit) & 1u) << (31 - bit);
  return result;
}

uint32_t Mix(uint32_t x) {
  x = (x ^ (x >> 16)) * 0x21f0aaadu;
  x = (x ^ (x >> 15)) * 0xd35a2d97u;
  return x ^ (x >> 15);
}

uint32_t Owen(uint32_t x, uint32_t seed) {
  x = Reverse(x);
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return Reverse(x);
}

/// Second Sobol dimension from its direction numbers: v_k = v_{k-1} ^ (v_{k-1} >> 1).
uint32_t SecondSobol(uint32_t index) {
  uint32_t direction = 1u << 31, result = 0;
  for (; index != 0; index >>= 1, direction ^= direction >> 1) {
    if (index & 1) result ^= direction;
  }
  return result;
}

struct Pair {
  double x, y;
};
Pair Reference(uint32_t pixel, uint32_t sample, uint32_t vertex, Purpose purpose, uint32_t seed) {
  constexpr uint32_t kGolden = 0x9e3779b9u;
  const uint32_t key = Mix(Mix(pixel + Mix(seed + kGolden)) + (sample % 4) * kGolden);
  const uint32_t hash =
      Mix(key + (vertex * stages::kPurposesPerVertex + static_cast<uint32_t>(purpose)) * kGolden);
  const auto derive = [&](uint32_t odd) { return (hash * odd) ^ ((hash * odd) >> 16); };
  const uint32_t index = Owen(sample / 4, hash);
  const uint32_t x = Owen(Reverse(index), derive(0x85ebca6bu));
  const uint32_t y = Owen(SecondSobol(index), derive(0xc2b2ae35u));
  return {(x >> 8) * 0x1p-24, (y >> 8) * 0x1p-24};
}

TEST(Sampler, EveryTargetAndWidthIsTheReference) {
  Draws draws;
  draws.seed = 12345;
  draws.purpose = Purpose::light_point;
  uint32_t state = 1;
  for (int i = 0; i < 4096; ++i) {
    draws.pixel.push_back(state = Mix(state + 1));
    draws.sample.push_back((state = Mix(state + 1)) >> (i % 32));
    draws.vertex.push_back(i % 300);
    draws.iteration.push_back(i % 17);
  }
  draws.sample[0] = 0xffffffffu;
  for (const SamplingKernels& kernels : AllSamplingKernels()) {
    SCOPED_TRACE(kernels.name);
    const Columns two = kernels.sample2(draws);
    const std::vector<double> one = kernels.sample1(draws);
    const std::vector<double> hash = kernels.hash(draws);
    const std::vector<double> first_hash = AllSamplingKernels().front().hash(draws);
    for (size_t i = 0; i < draws.pixel.size(); ++i) {
      const Pair expected =
          Reference(draws.pixel[i], draws.sample[i], draws.vertex[i], draws.purpose, draws.seed);
      ASSERT_EQ(two[0][i], expected.x) << i;
      ASSERT_EQ(two[1][i], expected.y) << i;
      ASSERT_EQ(one[i], expected.x) << i;
      ASSERT_EQ(hash[i], first_hash[i]) << i;
    }
  }
}

// Hard case 41: dividing 32 bits by 2^32 rounds 128 words up to 1.0f.
TEST(Sampler, UnitIntervalIsHalfOpenForEveryWord) {
  Words words;
  for (uint32_t i = 0; i < 4096; ++i) words.push_back(0xffffffffu - i);
  for (uint32_t i = 0; i < 4096; ++i) words.push_back(i);
  for (uint32_t bit = 0; bit < 32; ++bit) {
    words.push_back(1u << bit);
    words.push_back((1u << bit) - 1);
  }
  for (const SamplingKernels& kernels : AllSamplingKernels()) {
    SCOPED_TRACE(kernels.name);
    const std::vector<double> u = kernels.unit(words);
    for (size_t i = 0; i < words.size(); ++i) {
      ASSERT_LT(u[i], 1.0) << words[i];
      ASSERT_EQ(u[i], (words[i] >> 8) * 0x1p-24) << words[i];
    }
  }
}

/// Every box of 2^-a x 2^-(m-a) holds exactly one of the 2^m points from `first` on.
void ExpectNet(const Columns& points, size_t first, int m, const std::string& what) {
  const size_t count = size_t{1} << m;
  for (int a = 0; a <= m; ++a) {
    std::vector<int> boxes(count, 0);
    for (size_t i = first; i < first + count; ++i) {
      const auto column = static_cast<size_t>(std::ldexp(points[0][i], a));
      const auto row = static_cast<size_t>(std::ldexp(points[1][i], m - a));
      ++boxes[(column << (m - a)) | row];
    }
    for (const int box : boxes) ASSERT_EQ(box, 1) << what << ": 2^-" << a << " x 2^-" << m - a;
  }
}

// Hard case 43.
TEST(Sampler, EveryPairIsAZeroMTwoNetInEveryAlignedRun) {
  for (uint32_t pixel = 0; pixel < 12; ++pixel) {
    const auto purpose = static_cast<Purpose>(pixel % 7);
    const Columns points = BestSamplingKernels().sample2(
        GroupDraws(pixel * 7919, pixel % 4, pixel / 3, purpose, 4096));
    for (int m = 0; m <= 12; ++m) {
      for (size_t first = 0; first + (size_t{1} << m) <= 4096; first += size_t{1} << m) {
        ExpectNet(points, first, m,
                  "pixel " + std::to_string(pixel) + " from " + std::to_string(first));
        if (HasFatalFailure()) return;
        if (first >= (size_t{8} << m)) break;
      }
    }
  }
}

TEST(Sampler, OneDimensionalNumbersAreStratified) {
  const std::vector<double> u =
      BestSamplingKernels().sample1(GroupDraws(5, 2, 3, Purpose::lobe, 1024));
  for (size_t first = 0; first < 1024; first += 64) {
    std::vector<int> cells(64, 0);
    for (size_t i = 0; i < 64; ++i) ++cells[static_cast<size_t>(u[first + i] * 64)];
    for (const int cell : cells) ASSERT_EQ(cell, 1);
  }
}

/// p-value of uniformity of pairs over a grid.
double PairTest(const std::vector<double>& a, const std::vector<double>& b, int grid) {
  std::vector<double> counts(grid * grid, 0);
  for (size_t i = 0; i < a.size(); ++i)
    ++counts[static_cast<int>(a[i] * grid) * grid + static_cast<int>(b[i] * grid)];
  return test::ChiSquaredTest(
      counts, std::vector<double>(grid * grid, static_cast<double>(a.size()) / (grid * grid)));
}

constexpr uint32_t kPixels = 1 << 17;

TEST(Sampler, NumbersOfOneSampleAreIndependentAcrossPixels) {
  const SamplingKernels& k = BestSamplingKernels();
  for (const uint32_t sample : {0u, 5u, 1022u}) {
    SCOPED_TRACE(sample);
    const Columns base = k.sample2(PixelDraws(sample, 1, Purpose::bsdf, kPixels));
    EXPECT_GT(PairTest(base[0], base[1], 32), test::kFalseAlarm) << "x, y";
    const Columns other = k.sample2(PixelDraws(sample, 1, Purpose::light_point, kPixels));
    EXPECT_GT(PairTest(base[0], other[0], 32), test::kFalseAlarm) << "purposes, x";
    EXPECT_GT(PairTest(base[0], other[1], 32), test::kFalseAlarm) << "purposes, y";
    const Columns next = k.sample2(PixelDraws(sample, 2, Purpose::bsdf, kPixels));
    EXPECT_GT(PairTest(base[0], next[0], 32), test::kFalseAlarm) << "vertices";
    const Columns group = k.sample2(PixelDraws(sample ^ 1, 1, Purpose::bsdf, kPixels));
    EXPECT_GT(PairTest(base[0], group[0], 32), test::kFalseAlarm) << "groups";
    Draws seeded = PixelDraws(sample, 1, Purpose::bsdf, kPixels);
    seeded.seed = 1;
    EXPECT_GT(PairTest(base[0], k.sample2(seeded)[0], 32), test::kFalseAlarm) << "seeds";
    std::vector<double> shifted(base[0].begin() + 1, base[0].end());
    EXPECT_GT(PairTest(shifted, base[0], 32), test::kFalseAlarm) << "neighbouring pixels";
  }
}

/// Low digits too: a scramble that flipped two dimensions' digits together would show here.
TEST(Sampler, DigitFlipsOfDimensionsAreIndependent) {
  const Columns u = BestSamplingKernels().sample2(PixelDraws(0, 1, Purpose::bsdf, kPixels));
  for (int i = 0; i < 12; ++i) {
    for (int j = 0; j < 12; ++j) {
      double agree = 0;
      for (uint32_t p = 0; p < kPixels; ++p) {
        agree += (static_cast<int>(std::ldexp(u[0][p], i + 1)) & 1) ==
                 (static_cast<int>(std::ldexp(u[1][p], j + 1)) & 1);
      }
      const double z = (agree - kPixels / 2.0) / std::sqrt(kPixels / 4.0);
      EXPECT_GT(test::NormalTail(z), test::kFalseAlarm / 144) << "digits " << i << ", " << j;
    }
  }
}

TEST(Sampler, PurposesAndGroupsOfOnePixelArePadded) {
  const SamplingKernels& k = BestSamplingKernels();
  constexpr uint32_t kCount = 1 << 14;
  for (uint32_t pixel = 0; pixel < 8; ++pixel) {
    SCOPED_TRACE(pixel);
    const std::vector<double> a = k.sample1(GroupDraws(pixel, 0, 1, Purpose::lobe, kCount));
    const std::vector<double> b = k.sample1(GroupDraws(pixel, 0, 1, Purpose::roulette, kCount));
    const std::vector<double> c = k.sample1(GroupDraws(pixel, 1, 1, Purpose::lobe, kCount));
    EXPECT_GT(PairTest(a, b, 16), test::kFalseAlarm);
    EXPECT_GT(PairTest(a, c, 16), test::kFalseAlarm);
  }
}

TEST(Sampler, HashIsUniformAndIndependentOverIterations) {
  const SamplingKernels& k = BestSamplingKernels();
  Draws draws = GroupDraws(3, 0, 1, Purpose::alpha, kPixels);
  for (uint32_t i = 0; i < kPixels; ++i) draws.iteration[i] = i & 15, draws.sample[i] = i >> 4;
  const std::vector<double> u = k.hash(draws);
  EXPECT_GT(PairTest({u.begin() + 1, u.end()}, u, 32), test::kFalseAlarm);
  EXPECT_GT(PairTest({u.begin() + 16, u.end()}, u, 32), test::kFalseAlarm);
}

// A test of the test: correlated numbers must not pass.
TEST(Sampler, PairTestSeesCorrelation) {
  const std::vector<double> u =
      BestSamplingKernels().sample1(PixelDraws(0, 1, Purpose::lobe, kPixels));
  std::vector<double> mixed;
  for (size_t i = 0; i < u.size(); ++i)
    mixed.push_back(i % 16 == 0 ? u[i] : u[(i * 31) % u.size()]);
  EXPECT_LT(PairTest(u, mixed, 32), test::kFalseAlarm);
}

// Integrates x y over the square: 16 scrambles of 4096 samples; plain random numbers would err
// by 3.4e-3.
TEST(Sampler, IntegratesSmoothFunctionsFarBetterThanRandomNumbers) {
  double worst = 0;
  for (uint32_t pixel = 0; pixel < 16; ++pixel) {
    const Columns u =
        BestSamplingKernels().sample2(GroupDraws(pixel, pixel % 4, 2, Purpose::bsdf, 4096));
    double sum = 0;
    for (int i = 0; i < 4096; ++i) sum += u[0][i] * u[1][i];
    worst = std::max(worst, std::abs(sum / 4096 - 0.25));
  }
  EXPECT_LT(worst, 5e-5);
}

/// Mean squared error over 16 scrambles of the mean of f over the first `count` samples.
template <class F>
double MeanSquaredError(uint32_t count, double exact, F f) {
  double sum2 = 0;
  for (uint32_t pixel = 0; pixel < 16; ++pixel) {
    Draws draws = GroupDraws(pixel, pixel % 4, 2, Purpose::light_point, count);
    const Columns light = BestSamplingKernels().sample2(draws);
    draws.purpose = Purpose::lobe;
    const std::vector<double> lobe = BestSamplingKernels().sample1(draws);
    double sum = 0;
    for (uint32_t i = 0; i < count; ++i) sum += f(light[0][i], light[1][i], lobe[i]);
    sum2 += (sum / count - exact) * (sum / count - exact);
  }
  return sum2 / 16;
}

// Hard case 46b: no floor, and never slower than random numbers, also across padded dimensions. 16
// scrambles know a mean squared error to a factor of 3.
TEST(Sampler, ErrorFallsAtLeastAsFastAsWithRandomNumbers) {
  const auto edge = [](double x, double y, double) { return x * x + y * y < 1 ? 1.0 : 0.0; };
  const auto padded = [](double x, double y, double z) { return x + 2 * y < 3 * z ? 1.0 : 0.0; };
  constexpr uint32_t kFew = 1 << 6, kMany = 1 << 18;
  const double edge_few = MeanSquaredError(kFew, std::atan(1.0), edge);
  EXPECT_LT(MeanSquaredError(kMany, std::atan(1.0), edge), edge_few * kFew / kMany / 8)
      << "two dimensions of one pair";
  const double padded_few = MeanSquaredError(kFew, 0.5, padded);
  EXPECT_LT(MeanSquaredError(kMany, 0.5, padded), padded_few * kFew / kMany * 3)
      << "three padded dimensions";
}

TEST(Sampler, DimensionsRepeatPastVertexTwoToTheTwentySeven) {
  Draws draws = GroupDraws(1, 0, 1u << 27, Purpose::lobe, 64);
  EXPECT_EQ(BestSamplingKernels().sample1(draws),
            BestSamplingKernels().sample1(GroupDraws(1, 0, 0, Purpose::lobe, 64)));
}

}  // namespace
}  // namespace carpool::tests
