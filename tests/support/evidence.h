// What many independent means, each with a known answer, say together.
#pragma once

#include <cstddef>
#include <vector>

#include "tests/support/statistics.h"

namespace carpool::test {

/// Collects means that are exactly right if the program is: rounding well below their errors.
///
///     evidence.Add(mean, truth);                 // as often as there are cases
///     if (!evidence.IsUniform()) ...             // some means err by more than their noise
///     if (!evidence.IsUnbiased(2e-5)) ...        // all means err the same way
class Evidence {
 public:
  void Add(const Mean& mean, double truth);
  /// Two estimates of one value: a p-value alone, since neither is the truth.
  void Add(double p) { p_values_.push_back(p); }

  size_t count() const { return p_values_.size(); }
  const std::vector<double>& p_values() const { return p_values_; }

  /// Are the p-values uniform, at kFalseAlarm?
  bool IsUniform() const;
  /// The distance from uniform (Kolmogorov's) that would be found with power 0.99.
  double SmallestDistance() const;

  /// The relative error that all means share, weighted by their precision, and its standard error.
  double CommonBias() const;
  double CommonError() const;
  /// Is it at most `slack`, at kFalseAlarm?
  bool IsUnbiased(double slack) const;
  /// The common bias that would be found with power 0.99.
  double SmallestCommonBias() const;
  /// The bias of a single mean that would be found at 1e-9 with power 0.99: the median of all.
  double SmallestSingleBias() const;

 private:
  std::vector<double> p_values_;
  std::vector<double> errors_;  // relative
  double degrees_ = 1;          // of freedom of the last mean
  double sum_ = 0, weight_ = 0;
};

}  // namespace carpool::test
