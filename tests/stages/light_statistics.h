// Statistical tests of estimators: z of a mean, chi-squared of counts, with their false-alarm
// rates.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace carpool::stages {

/// A correct estimator exceeds these with probability 1e-6; seeds are fixed, so a pass stays a
/// pass.
constexpr double kLargestZ = 4.9;             // two-sided
constexpr double kLargestChiSquaredZ = 4.76;  // one-sided

/// Mean and standard error of independent samples.
class MeanEstimate {
 public:
  void Add(double x) {
    ++count_;
    const double delta = x - mean_;
    mean_ += delta / static_cast<double>(count_);
    squares_ += delta * (x - mean_);
  }
  double mean() const { return mean_; }
  double standard_error() const {
    const double n = static_cast<double>(count_);
    return std::sqrt(squares_ / (n - 1) / n);
  }
  /// Standard errors between the mean and the truth; `rounding` is the relative error that the
  /// float arithmetic of the estimator may have.
  double Z(double truth, double rounding) const {
    return std::abs(mean_ - truth) / std::hypot(standard_error(), rounding * truth);
  }

 private:
  size_t count_ = 0;
  double mean_ = 0, squares_ = 0;
};

/// Chi-squared of counts against expectations, as a normal deviate (Wilson & Hilferty 1931). Cells
/// that expect fewer than 10 are pooled. A count where none is expected gives infinity.
inline double ChiSquaredZ(const std::vector<double>& expected, const std::vector<double>& counts) {
  double chi = 0, pooled_expected = 0, pooled_count = 0;
  int cells = 0;
  const auto add = [&](double e, double n) {
    chi += (n - e) * (n - e) / e;
    ++cells;
  };
  for (size_t i = 0; i < expected.size(); ++i) {
    if (expected[i] <= 0 && counts[i] > 0) return HUGE_VAL;
    if (expected[i] >= 10) {
      add(expected[i], counts[i]);
    } else {
      pooled_expected += expected[i];
      pooled_count += counts[i];
    }
  }
  if (pooled_expected >= 1) add(pooled_expected, pooled_count);
  const double freedom = cells - 1;
  const double spread = 2 / (9 * freedom);
  return (std::cbrt(chi / freedom) - (1 - spread)) / std::sqrt(spread);
}

}  // namespace carpool::stages
