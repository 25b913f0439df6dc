// The statistics against published values, and against the rates that they promise.
#include "tests/support/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/evidence.h"

namespace carpool::test {
namespace {

TEST(Statistics, TailsHaveTheirPublishedValues) {
  EXPECT_NEAR(NormalTail(1.959963985), 0.05, 1e-9);
  EXPECT_NEAR(NormalTail(kLargestZ) / kFalseAlarm, 0.958, 0.001);
  EXPECT_NEAR(StudentTail(2.131449546, 15), 0.05, 1e-9);
  EXPECT_NEAR(StudentTail(1, 1), 0.5, 1e-12);  // Cauchy's distribution
  EXPECT_NEAR(StudentTail(5, 1e8) / NormalTail(5), 1, 1e-5);
  EXPECT_NEAR(StudentQuantile(0.05, 15), 2.131449546, 1e-6);
  EXPECT_NEAR(ChiSquaredTail(18.307038, 10), 0.05, 1e-8);
  EXPECT_NEAR(ChiSquaredTail(2, 2), std::exp(-1.0), 1e-12);
}

TEST(Statistics, RatesHaveTheirExactBounds) {
  const Interval none = RateInterval(0, 1000, 0.95);
  EXPECT_EQ(none.low, 0);
  EXPECT_NEAR(none.high, 1 - std::pow(0.025, 1e-3), 1e-12);
  const Interval some = RateInterval(5, 20, 0.95);  // the textbook's 0.0866 and 0.4910
  EXPECT_NEAR(some.low, 0.0866, 1e-4);
  EXPECT_NEAR(some.high, 0.4910, 1e-4);
  EXPECT_EQ(RateInterval(20, 20, 0.95).high, 1);
  EXPECT_NEAR(RateTail(1, 10, 0.1), 1 - std::pow(0.9, 10), 1e-12);
}

TEST(Statistics, ChiSquaredKnowsImpossibleCells) {
  EXPECT_EQ(ChiSquaredTest({100, 1}, {101, 0}), 0);
  EXPECT_EQ(ChiSquaredTest({100, 0}, {100, 0}), 1);
  EXPECT_NEAR(ChiSquaredTest({110, 90}, {100, 100}), NormalTail(std::sqrt(2.0)), 1e-9);
}

TEST(Statistics, KolmogorovsTailHasItsPublishedValues) {
  EXPECT_NEAR(KolmogorovTail(1.3581 / 1e4, 1e8), 0.05, 1e-5);
  EXPECT_NEAR(KolmogorovTail(1.6276 / 1e4, 1e8), 0.01, 1e-5);
  EXPECT_NEAR(KolmogorovTail(0.29408, 20), 0.05, 2e-3);  // Massey 1951, n = 20
  EXPECT_EQ(KolmogorovTail(0, 100), 1);
  EXPECT_NEAR(KolmogorovTail(KolmogorovDistance(1e-6, 50), 50), 1e-6, 1e-9);
  EXPECT_NEAR(DistanceFromUniform({0.9, 0.1, 0.2}), 2.0 / 3 - 0.2, 1e-12);
}

TEST(Evidence, FindsABiasOfAllRunsAndNoneWhereThereIsNone) {
  std::mt19937 rng(2);
  std::normal_distribution<double> noise;
  for (const double bias : {0.0, 0.008}) {
    Evidence evidence;
    for (int run = 0; run < 400; ++run) {
      Mean mean;
      for (int k = 0; k < 16; ++k) mean.Add(5 * (1 + bias) * (1 + 0.02 * noise(rng)));
      evidence.Add(mean, 5);
    }
    EXPECT_EQ(evidence.count(), 400u);
    EXPECT_NEAR(evidence.CommonBias(), bias, 5 * evidence.CommonError());
    EXPECT_EQ(evidence.IsUniform(), bias == 0);
    EXPECT_EQ(evidence.IsUnbiased(2e-5), bias == 0);
    EXPECT_LT(evidence.SmallestCommonBias(), 0.008);
    EXPECT_GT(evidence.SmallestSingleBias(), 0.008);
  }
}

/// Under the null hypothesis p-values are uniform: 2000 of them, and the share below 0.05 within
/// what one false alarm in 1e6 allows.
TEST(Statistics, PValuesAreUniform) {
  std::mt19937 rng(1);
  std::normal_distribution<double> noise(3, 2);
  uint64_t one_sample = 0, two_samples = 0;
  constexpr uint64_t kTests = 2000;
  for (uint64_t i = 0; i < kTests; ++i) {
    Mean a, b;
    for (int k = 0; k < 16; ++k) a.Add(noise(rng));
    for (int k = 0; k < 12; ++k) b.Add(noise(rng));
    one_sample += MeanTail(a, 3, 0) < 0.05;
    two_samples += WelchTail(a, b, 0) < 0.05;
  }
  for (const uint64_t hits : {one_sample, two_samples}) {
    const Interval rate = RateInterval(hits, kTests, 1 - kFalseAlarm);
    EXPECT_LT(rate.low, 0.05) << hits;
    EXPECT_GT(rate.high, 0.05) << hits;
  }
}

TEST(Statistics, SlackIsNoProofAndNanIs) {
  Mean exact, broken;
  for (int i = 0; i < 4; ++i) {
    exact.Add(1.001);
    broken.Add(NAN);
  }
  EXPECT_EQ(MeanTail(exact, 1, 0.002), 1);
  EXPECT_EQ(MeanTail(exact, 1, 0.0005), 0);
  EXPECT_EQ(MeanTail(broken, 1, 0.0005), 0);
  EXPECT_EQ(WelchTail(exact, exact, 0), 1);
}

}  // namespace
}  // namespace carpool::test
