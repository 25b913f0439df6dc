// The film: exact sums in any order, stated range and quantum, rejected samples counted, errors
// that are calibrated.
#include "stages/film/accumulator.h"

#include <gtest/gtest.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "render/film/resolve.h"

namespace carpool::stages {
namespace {

std::vector<float> RandomSamples(size_t count, uint32_t seed) {
  std::mt19937 random(seed);
  std::lognormal_distribution<float> value(0, 3);
  std::vector<float> samples(count);
  for (float& s : samples) s = value(random);
  return samples;
}

void AddGrey(FilmAccumulator& film, uint32_t pixel, uint32_t sample, float value) {
  const float rgb[3] = {value, value, value};
  film.Add(pixel, sample, rgb);
}

TEST(Film, SumsDoNotDependOnOrder) {
  const std::vector<float> samples = RandomSamples(4000, 1);
  std::vector<uint32_t> order(samples.size());
  std::iota(order.begin(), order.end(), 0u);
  FilmAccumulator forwards(1, 1, {}), shuffled(1, 1, {}), threaded(1, 1, {});
  for (const uint32_t i : order) AddGrey(forwards, 0, i, samples[i]);
  std::shuffle(order.begin(), order.end(), std::mt19937(2));
  for (const uint32_t i : order) AddGrey(shuffled, 0, i, samples[i]);
  tbb::parallel_for(size_t{0}, order.size(),
                    [&](size_t i) { AddGrey(threaded, 0, order[i], samples[order[i]]); });
  for (int g = 0; g < kScrambles; ++g) {
    EXPECT_EQ(forwards.Sum(0, g, 1), shuffled.Sum(0, g, 1));
    EXPECT_EQ(forwards.Sum(0, g, 1), threaded.Sum(0, g, 1));
  }
  EXPECT_EQ(threaded.Samples(0), samples.size());
}

// A pixel's count is kept in pieces of 16 bits beside what the sums leave over 64, which may be
// negative.
TEST(Film, CountsGoOnPastSixteenBitsBesideSumsOfAnySign) {
  constexpr uint32_t kSamples = 70000 * kScrambles;
  FilmAccumulator film(2, 1, {});
  for (uint32_t i = 0; i < kSamples; ++i) {
    const float below[3] = {-1, 2, i % 8 < 4 ? -1e9f : 1e9f};
    film.Add(1, i, below);
    if (i == 65536 * kScrambles - 2) EXPECT_EQ(film.Samples(1), i + 1);
    if (i == 65536 * kScrambles - 1) EXPECT_EQ(film.Samples(1), i + 1);
  }
  EXPECT_EQ(film.Samples(1), kSamples);
  EXPECT_EQ(film.Samples(0), 0u);
  for (int g = 0; g < kScrambles; ++g) {
    EXPECT_EQ(film.Sum(1, g, 0), -70000.0);
    EXPECT_EQ(film.Sum(1, g, 1), 140000.0);
    EXPECT_EQ(film.Sum(1, g, 2), 0.0);
  }
}

// Many threads, each with one writer at a time, whose lock goes from tile to tile: every sample of
// every pixel is there. The widths are odd, so that tiles are cut and share locks.
TEST(Film, WritersOfManyTilesLoseNothing) {
  constexpr uint32_t kSamples = 24;
  for (const uint32_t width : {1u, 37u, 1000u}) {
    const uint32_t height = 48, pixels = width * height;
    FilmAccumulator film(width, height, {});
    std::vector<uint32_t> places(size_t{pixels} * kSamples);
    std::iota(places.begin(), places.end(), 0u);
    std::shuffle(places.begin(), places.end(), std::mt19937(width));
    tbb::parallel_for(tbb::blocked_range<size_t>(0, places.size(), 64), [&](const auto& range) {
      FilmAccumulator::Writer writer(film);
      for (size_t i = range.begin(); i < range.end(); ++i) {
        const uint32_t pixel = places[i] / kSamples, sample = places[i] % kSamples;
        const float rgb[3] = {1, static_cast<float>(pixel), static_cast<float>(sample)};
        writer.Add(pixel, sample, rgb);
      }
    });
    constexpr uint32_t kEach = kSamples / kScrambles;
    for (uint32_t pixel = 0; pixel < pixels; ++pixel) {
      ASSERT_EQ(film.Samples(pixel), kSamples) << width << ", " << pixel;
      for (uint32_t g = 0; g < kScrambles; ++g) {
        ASSERT_EQ(film.Sum(pixel, g, 0), kEach);
        ASSERT_EQ(film.Sum(pixel, g, 1), static_cast<double>(kEach) * pixel);
        ASSERT_EQ(film.Sum(pixel, g, 2), kEach * g + kScrambles * (kEach * (kEach - 1) / 2));
      }
    }
  }
}

TEST(Film, SamplesGoToTheirScramble) {
  FilmAccumulator film(1, 1, {});
  for (uint32_t i = 0; i < 8; ++i) AddGrey(film, 0, i, static_cast<float>(1 << i));
  for (int g = 0; g < kScrambles; ++g) EXPECT_EQ(film.Sum(0, g, 0), (1 << g) + (1 << (g + 4)));
}

/// HARD_CASES row 42: at mean 1000 and standard deviation 1 the mean of a sum that has gone far
/// past 2^64 quanta is exact to 1e-6. The 2^30 samples are stood in for by adding values 2^20 times
/// as large 2^10 times.
TEST(Film, SumsCarryBeyond64Bits) {
  FilmAccumulator film(1, 1, {});
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 1);
  double exact[kScrambles] = {};
  for (uint32_t i = 0; i < 1024; ++i) {
    const auto value = static_cast<float>((1000 + noise(random)) * 0x1p20);
    exact[i % kScrambles] += value;
    AddGrey(film, 0, i, value);
  }
  for (int g = 0; g < kScrambles; ++g) {
    EXPECT_GT(exact[g] / kFilmQuantum, 0x1p64);
    EXPECT_NEAR(film.Sum(0, g, 2) / exact[g], 1, 1e-12);
  }
}

TEST(Film, NegativeSamplesBorrow) {
  FilmAccumulator film(1, 1, {});
  AddGrey(film, 0, 0, 2);
  AddGrey(film, 0, 4, -5);
  EXPECT_EQ(film.Sum(0, 0, 0), -3);
  AddGrey(film, 0, 8, 4);
  EXPECT_EQ(film.Sum(0, 0, 0), 1);
}

TEST(Film, RejectsAndCountsWhatIsNotANumberOrTooLarge) {
  FilmAccumulator film(2, 1, {});
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float broken[3] = {std::numeric_limits<float>::quiet_NaN(), 1, kInfinity};
  film.Add(0, 0, broken);
  EXPECT_EQ(film.Sum(0, 0, 0), 0);
  EXPECT_EQ(film.Sum(0, 0, 1), 1);
  EXPECT_EQ(film.Sum(0, 0, 2), 0);
  AddGrey(film, 1, 0, 1e30f);
  EXPECT_EQ(film.Sum(1, 0, 0), kFilmLargest);
  const SampleLedger ledger = film.Ledger();
  EXPECT_EQ(ledger.Count(), 2u);
  EXPECT_EQ(ledger.Of(SampleFault::not_finite).count, 1u);
  EXPECT_EQ(ledger.Of(SampleFault::not_finite).pixel, 0u);
  EXPECT_EQ(ledger.Of(SampleFault::too_large).pixel, 1u);
  EXPECT_EQ(film.Samples(0), 1u);
}

TEST(Film, TheLedgerKeepsTheFirstOfEachCauseInWhateverOrderTheyCome) {
  FilmAccumulator film(4, 1, {});
  for (const auto& [pixel, sample] : {std::pair{2u, 7u}, {3u, 5u}, {1u, 5u}, {0u, 9u}})
    AddGrey(film, pixel, sample, -1);
  const SampleLedger::Entry entry = film.Ledger().Of(SampleFault::negative);
  EXPECT_EQ(entry.count, 4u);
  EXPECT_EQ(entry.sample, 5u);
  EXPECT_EQ(entry.pixel, 1u);
  EXPECT_EQ(film.Sum(3, 5 % kScrambles, 0), -1) << "counted, not hidden";
}

TEST(Film, TheClampKeepsTheHueAndSaysWhatItRemoved) {
  FilmAccumulator film(1, 1, {}, 10);
  const float bright[3] = {40, 20, 0};
  film.Add(0, 0, bright);
  AddGrey(film, 0, 4, 10);
  EXPECT_EQ(film.Sum(0, 0, 0), 20);
  EXPECT_EQ(film.Sum(0, 0, 1), 15);
  const SampleLedger ledger = film.Ledger();
  EXPECT_EQ(ledger.Of(SampleFault::clamped).count, 1u);
  EXPECT_NEAR(ledger.removed_energy, 0.2126 * 30 + 0.7152 * 15, 1e-9);
  EXPECT_NEAR(ledger.energy, 0.2126 * 40 + 0.7152 * 20 + 10, 1e-9);
}

TEST(Film, TakesAtMost128BytesPerPixel) {
  EXPECT_LE(FilmAccumulator(10, 10, {}).bytes(), 128u * 100);
}

TEST(Film, IdsAndDepthComeFromSampleZero) {
  FilmAccumulator film(
      1, 1, {.albedo = true, .normal = true, .depth = true, .object = true, .material = true});
  for (const uint32_t sample : {3u, 0u, 1u, 2u}) {
    const auto f = static_cast<float>(sample);
    film.AddFirstHit(0, sample, {{f, f, f}, {0, 0, 1}, 10 + f, 100 + sample, 200 + sample});
    AddGrey(film, 0, sample, 1);
  }
  EXPECT_EQ(film.Depth(0), 10);
  EXPECT_EQ(film.Object(0), 100u);
  EXPECT_EQ(film.Material(0), 200u);
  double albedo[3];
  film.Albedo(0, albedo);
  EXPECT_NEAR(albedo[0], 1.5, 1e-9);
}

/// The stated standard error is the spread of means over seeds: 64 x 64 pixels of exponential
/// noise, whose mean of 64 samples has the standard error 1/8. The pooled estimate has 64 x 3
/// degrees of freedom a tile, over 64 tiles: its mean is within 1 % except once in 1e6 seeds; the
/// seed is fixed.
TEST(Resolve, StandardErrorIsCalibrated) {
  constexpr uint32_t kSide = 64, kSamples = 64;
  FilmAccumulator film(kSide, kSide, {});
  std::mt19937 random(5);
  std::exponential_distribution<float> value(1);
  for (uint32_t pixel = 0; pixel < kSide * kSide; ++pixel) {
    for (uint32_t s = 0; s < kSamples; ++s) AddGrey(film, pixel, s, value(random));
  }
  const render::RgbPlane error = render::ResolveStandardError(film);
  double mean_square = 0;
  for (const float e : error) mean_square += double{e} * e / static_cast<double>(error.size());
  EXPECT_NEAR(std::sqrt(mean_square), 1.0 / 8, 0.01 / 8 * 3);
  EXPECT_NEAR(render::EstimateNoise(film), 1.0 / 8, 0.03 / 8 + 0.002);
}

TEST(Resolve, PreviewFillsHolesFromNeighbours) {
  FilmAccumulator film(16, 8, {});
  AddGrey(film, 3, 0, 2);
  AddGrey(film, 12, 0, 5);
  const render::RgbPlane plane = render::ResolvePreview(film);
  EXPECT_EQ(plane[0], 2);
  EXPECT_EQ(plane[(7 * 16 + 15) * 3], 5);
}

}  // namespace
}  // namespace carpool::stages
