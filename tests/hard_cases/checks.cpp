// Verdicts and the words of failures.
#include "tests/hard_cases/checks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>

#include "tests/hard_cases/figures.h"

namespace carpool::test {
namespace {

constexpr int kSeeds = 16;
constexpr double kSuspicion = 1e-3;
/// Standard errors in a bias that is found at false-alarm 1e-6 with power 0.99, at 15 degrees of
/// freedom.
const double kPowerErrors = StudentQuantile(kFalseAlarm, kSeeds - 1) + 2.33;

std::string Format(const char* format, auto... values) {
  char line[512];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

/// "1.0002 (99 % interval 1.0001 to 1.0003)"
std::string Describe(const Mean& mean) {
  const double reach = StudentQuantile(0.01, mean.Count() - 1) * mean.Error();
  return Format("%.9g (99 %% interval %.9g to %.9g)", mean.Value(), mean.Value() - reach,
                mean.Value() + reach);
}

/// Runs `tail` on few estimates, and on four times as many new ones if those look suspicious.
/// Returns the p-value that counts.
double Judge(const std::function<double(uint32_t first, int count)>& tail) {
  const double p = tail(kFirstSeed, kSeeds);
  return p >= kSuspicion ? p : tail(kFirstSeed + kSeeds, 4 * kSeeds);
}

}  // namespace

Subject SubjectOf(const SceneCase& scene) {
  const auto renderer = std::make_shared<CaseRenderer>(scene);
  return {scene.name,
          [renderer](uint32_t first, int count) { return renderer->Seeds(first, count); },
          [scene](uint32_t seed) { return RenderCommand(scene, seed); }};
}

void ExpectMean(const Subject& subject, const Claim& claim) {
  const double scale = std::abs(claim.expected);
  Mean mean;
  uint32_t seed = 0;
  const double p = Judge([&](uint32_t first, int count) {
    seed = first;
    mean = subject.sampler(first, count);
    return MeanTail(mean, claim.expected, (claim.slack + kRounding) * scale);
  });
  RecordFigure(subject.name, mean.Value() / claim.expected - 1, "relative error", p >= kFalseAlarm);
  EXPECT_GE(p, kFalseAlarm) << subject.name << ": expected " << Format("%.9g", claim.expected)
                            << ", measured " << Describe(mean) << ", p = " << p << ", seeds "
                            << seed << " to " << seed + static_cast<uint32_t>(mean.Count()) - 1
                            << "\n  alone: " << subject.command(seed);
  EXPECT_LE(kPowerErrors * mean.Error(), claim.precision * scale)
      << subject.name << ": a bias of " << claim.precision
      << " could go unseen; the case needs more samples";
}

void ExpectSame(const Subject& a, const Subject& b, const Claim& claim, double scale) {
  Mean mean_a, mean_b;
  uint32_t seed = 0;
  const double p = Judge([&](uint32_t first, int count) {
    seed = first;
    mean_a = a.sampler(first, count);
    mean_b = b.sampler(first + 100'000, count).Scaled(scale);
    return WelchTail(mean_a, mean_b, (claim.slack + kRounding) * std::abs(mean_a.Value()));
  });
  RecordFigure(a.name + " = " + b.name, mean_b.Value() / mean_a.Value() - 1, "relative difference",
               p >= kFalseAlarm);
  EXPECT_GE(p, kFalseAlarm) << a.name << " measured " << Describe(mean_a) << ", " << b.name
                            << (scale == 1 ? "" : " scaled") << " measured " << Describe(mean_b)
                            << ", p = " << p << ", seeds from " << seed << " and " << seed + 100'000
                            << "\n  alone: " << a.command(seed)
                            << "\n  and:   " << b.command(seed + 100'000);
  EXPECT_LE(kPowerErrors * std::hypot(mean_a.Error(), mean_b.Error()),
            claim.precision * std::abs(mean_a.Value()))
      << a.name << " = " << b.name << ": a difference of " << claim.precision
      << " could go unseen; the case needs more samples";
}

void ExpectRate(const std::string& what, uint64_t failures, uint64_t trials, double most) {
  const Interval bound = RateInterval(failures, trials, 0.98);
  std::printf("%s: %llu of %llu, rate at most %.3g with 99 %% confidence\n", what.c_str(),
              static_cast<unsigned long long>(failures), static_cast<unsigned long long>(trials),
              bound.high);
  const double p = RateTail(failures, trials, most);
  RecordFigure(what, bound.high, "rate, 99 % upper bound", p >= kFalseAlarm);
  EXPECT_GE(p, kFalseAlarm) << what << ": " << failures << " of " << trials
                            << " failed where a rate of " << most << " is allowed, p = " << p;
}

}  // namespace carpool::test
