// Honest statistics for tests: tail probabilities, estimates with their error, bounds on rates.
//
// Every p-value is the chance that a correct program does worse. Seeds are fixed, so a pass stays a
// pass.
#pragma once

#include <cstdint>
#include <vector>

namespace carpool::test {

/// False-alarm rate of each statistical check.
constexpr double kFalseAlarm = 1e-6;
/// The same as a deviate: |z| is larger with that probability.
constexpr double kLargestZ = 4.9;

/// Two-sided p-value of a standard normal deviate.
double NormalTail(double z);
/// Two-sided p-value of Student's t with `degrees` > 0 of freedom.
double StudentTail(double t, double degrees);
/// Upper tail of the chi-squared distribution.
double ChiSquaredTail(double statistic, double degrees);
/// The t that StudentTail takes to `p`, 0 < p < 1.
double StudentQuantile(double p, double degrees);

/// The largest difference between the shares of `values` below each x in [0, 1] and x itself.
double DistanceFromUniform(std::vector<double> values);
/// p-value of such a distance of `count` independent values that are uniform (Kolmogorov's limit
/// with the correction of Stephens 1970, good to some percent from 8 values on).
double KolmogorovTail(double distance, double count);
/// The distance that KolmogorovTail takes to `p` < 0.1.
double KolmogorovDistance(double p, double count);

/// p-value of counts against expected counts with the same total; cells that expect fewer than 10
/// are pooled. 0 where something was counted that is expected never.
double ChiSquaredTest(const std::vector<double>& counts, const std::vector<double>& expected);

struct Interval {
  double low = 0, high = 0;
};

/// Exact two-sided interval for a rate of which `hits` of `trials` were seen (Clopper and Pearson
/// 1934): the true rate is outside with a probability of at most 1 - `confidence`.
Interval RateInterval(uint64_t hits, uint64_t trials, double confidence);
/// p-value of seeing at least `hits` of `trials` if the true rate is at most `rate`.
double RateTail(uint64_t hits, uint64_t trials, double rate);

/// Mean of independent values and its standard error (Welford's recurrence).
class Mean {
 public:
  void Add(double x) {
    ++count_;
    const double delta = x - mean_;
    mean_ += delta / count_;
    squares_ += delta * (x - mean_);
  }
  /// The same of all values times `factor`.
  Mean Scaled(double factor) const {
    Mean scaled = *this;
    scaled.mean_ *= factor;
    scaled.squares_ *= factor * factor;
    return scaled;
  }
  double Count() const { return count_; }
  double Value() const { return mean_; }
  double Error() const;  // 0 for fewer than two values
  /// Standard errors between the mean and the truth; `rounding` is the relative error that the
  /// float arithmetic of the estimator may have.
  double Z(double truth, double rounding) const;

 private:
  double count_ = 0, mean_ = 0, squares_ = 0;
};

/// p-value of `mean` if the truth lies within `slack` of `truth`, by Student's t. `slack` > 0 also
/// covers what arithmetic alone may be off.
double MeanTail(const Mean& mean, double truth, double slack);

/// p-value of two independent means if their truths lie within `slack` of each other (Welch 1947).
double WelchTail(const Mean& a, const Mean& b, double slack);

}  // namespace carpool::test
