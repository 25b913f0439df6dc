// Statistics for tests: chi-squared and normal tail probabilities, running means.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace carpool::tests {

/// False-alarm rate of each statistical check; seeds are fixed, so a pass stays a pass.
constexpr double kFalseAlarm = 1e-6;

/// Upper tail of the chi-squared distribution: the regularised incomplete gamma function Q(k/2,
/// x/2), by its series below the mode and Lentz's continued fraction above (Numerical Recipes,
/// section 6.2).
inline double ChiSquaredTail(double statistic, double degrees) {
  const double a = degrees / 2, x = statistic / 2;
  if (x <= 0) return 1;
  const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1) {
    double term = 1 / a, sum = term;
    for (int n = 1; n < 10000 && term > sum * 1e-16; ++n) sum += term *= x / (a + n);
    return 1 - front * sum;
  }
  double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
  for (int i = 1; i < 10000; ++i) {
    const double an = -i * (i - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    h *= d * c;
    if (std::abs(d * c - 1) < 1e-15) break;
  }
  return front * h;
}

/// p-value of counts against expected counts with the same total; cells that expect fewer than 10
/// are pooled.
inline double ChiSquaredTest(const std::vector<double>& counts,
                             const std::vector<double>& expected) {
  double statistic = 0, pooled_count = 0, pooled_expected = 0;
  double cells = 0;
  for (size_t i = 0; i < counts.size(); ++i) {
    if (expected[i] < 10) {
      pooled_count += counts[i];
      pooled_expected += expected[i];
      continue;
    }
    statistic += (counts[i] - expected[i]) * (counts[i] - expected[i]) / expected[i];
    ++cells;
  }
  if (pooled_expected >= 10) {
    statistic +=
        (pooled_count - pooled_expected) * (pooled_count - pooled_expected) / pooled_expected;
    ++cells;
  } else if (pooled_count > 10 + 10 * pooled_expected) {
    return 0;  // mass where there should be next to none
  }
  return cells > 1 ? ChiSquaredTail(statistic, cells - 1) : 1;
}

/// Two-sided p-value of a standard normal deviate.
inline double NormalTail(double z) {
  return std::erfc(std::abs(z) / std::sqrt(2.0));
}

/// Mean of independent values and its standard error.
struct Mean {
  double sum = 0, sum2 = 0, count = 0;

  void Add(double x) {
    sum += x;
    sum2 += x * x;
    ++count;
  }
  double Value() const { return sum / count; }
  double Error() const {
    const double variance = (sum2 - sum * sum / count) / (count - 1);
    return std::sqrt(variance > 0 ? variance / count : 0);
  }
};

}  // namespace carpool::tests
