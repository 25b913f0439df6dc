// The suite's checks: means against closed forms, means against each other, failure rates.
//
// A check whose p-value is below 1e-3 takes four times as many new samples, once, and then fails
// below 1e-6: a correct renderer fails with a probability below 1e-9, a wrong one has little to
// hope for. A check must also be sharp: if the samples could not have shown a bias of the stated
// precision, that is a failure, too.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "tests/hard_cases/scene_case.h"
#include "tests/support/statistics.h"

namespace carpool::test {

/// What a mean is held against.
struct Claim {
  double expected = 0;
  double slack = 0;  // relative: what the claim itself may be off, e.g. by a mesh for a sphere
  double precision = 0.005;  // relative bias that must be found with power 0.99 at 1e-6
};

/// Relative error that float arithmetic may leave in any mean.
constexpr double kRounding = 2e-5;

/// Independent estimates: `count` of them, from seed `first` on.
using Sampler = std::function<Mean(uint32_t first, int count)>;

/// A sampler with its name and the command that repeats its first estimate.
struct Subject {
  std::string name;
  Sampler sampler;
  std::function<std::string(uint32_t seed)> command;
};

Subject SubjectOf(const SceneCase& scene);

/// Z: the mean equals the claim.
void ExpectMean(const Subject& subject, const Claim& claim);
/// W: two means are equal; `scale` is what the second's is multiplied by. `claim.expected` is
/// unused.
void ExpectSame(const Subject& a, const Subject& b, const Claim& claim, double scale = 1);
/// R: the true rate of failure is at most `most`. Prints the rate and its 99 % upper bound.
void ExpectRate(const std::string& what, uint64_t failures, uint64_t trials, double most);

/// Seeds of the suite start here.
constexpr uint32_t kFirstSeed = 1;

}  // namespace carpool::test
