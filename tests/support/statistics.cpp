// Incomplete gamma and beta functions, and the tests that stand on them.
#include "tests/support/statistics.h"

#include <algorithm>
#include <cmath>

namespace carpool::test {
namespace {

constexpr int kTerms = 100'000;  // of a series or fraction; all that occur converge long before

/// Q(a, x), the upper regularised incomplete gamma function: its series below the mode and Lentz's
/// continued fraction above (Numerical Recipes, section 6.2).
double UpperGamma(double a, double x) {
  if (x <= 0) return 1;
  const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1) {
    double term = 1 / a, sum = term;
    for (int n = 1; n < kTerms && term > sum * 1e-16; ++n) sum += term *= x / (a + n);
    return 1 - front * sum;
  }
  double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
  for (int i = 1; i < kTerms; ++i) {
    const double an = -i * (i - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    h *= d * c;
    if (std::abs(d * c - 1) < 1e-15) break;
  }
  return front * h;
}

/// Continued fraction of the incomplete beta function (Numerical Recipes, section 6.4).
double BetaFraction(double a, double b, double x) {
  const auto away = [](double v) { return std::abs(v) < 1e-300 ? 1e-300 : v; };
  double c = 1, d = 1 / away(1 - (a + b) * x / (a + 1)), h = d;
  for (int m = 1; m < kTerms; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    d = 1 / away(1 + even * d);
    c = away(1 + even / c);
    h *= d * c;
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    d = 1 / away(1 + odd * d);
    c = away(1 + odd / c);
    h *= d * c;
    if (std::abs(d * c - 1) < 1e-15) break;
  }
  return h;
}

/// I_x(a, b), the regularised incomplete beta function.
double Beta(double a, double b, double x) {
  if (x <= 0) return 0;
  if (x >= 1) return 1;
  const double front = std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) +
                                a * std::log(x) + b * std::log1p(-x));
  if (x < (a + 1) / (a + b + 2)) return front * BetaFraction(a, b, x) / a;
  return 1 - front * BetaFraction(b, a, 1 - x) / b;
}

/// The argument in [low, high] at which a falling function reaches `target`.
template <class F>
double Bisect(double low, double high, double target, F falling) {
  for (int i = 0; i < 200; ++i) {
    const double middle = (low + high) / 2;
    (falling(middle) > target ? low : high) = middle;
  }
  return (low + high) / 2;
}

/// p-value of a deviation, of which `slack` proves nothing, with the given standard error.
double ExcessTail(double deviation, double slack, double error, double degrees) {
  const double excess = std::abs(deviation) - slack;
  if (!(excess > 0)) return std::isnan(deviation) ? 0 : 1;
  return error > 0 ? StudentTail(excess / error, degrees) : 0;
}

}  // namespace

double NormalTail(double z) {
  return std::erfc(std::abs(z) / std::sqrt(2.0));
}

double StudentTail(double t, double degrees) {
  return Beta(degrees / 2, 0.5, degrees / (degrees + t * t));
}

double ChiSquaredTail(double statistic, double degrees) {
  return UpperGamma(degrees / 2, statistic / 2);
}

double StudentQuantile(double p, double degrees) {
  return Bisect(0, 1e6, p, [&](double t) { return StudentTail(t, degrees); });
}

double DistanceFromUniform(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto n = static_cast<double>(values.size());
  double distance = 0;
  for (size_t i = 0; i < values.size(); ++i) {
    const auto below = static_cast<double>(i);
    distance = std::max({distance, values[i] - below / n, (below + 1) / n - values[i]});
  }
  return distance;
}

double KolmogorovTail(double distance, double count) {
  const double root = std::sqrt(count), x = (root + 0.12 + 0.11 / root) * distance;
  if (x < 0.2) return 1;  // the series below needs many terms, and 1 - its sum is under 1e-12
  double sum = 0;
  for (int k = 1; k <= 100; ++k) sum += (k % 2 == 1 ? 2 : -2) * std::exp(-2.0 * k * k * x * x);
  return std::clamp(sum, 0.0, 1.0);
}

double KolmogorovDistance(double p, double count) {
  return Bisect(0, 10, p, [&](double distance) { return KolmogorovTail(distance, count); });
}

double ChiSquaredTest(const std::vector<double>& counts, const std::vector<double>& expected) {
  double statistic = 0, pooled_count = 0, pooled_expected = 0;
  double cells = 0;
  const auto add = [&](double n, double e) {
    statistic += (n - e) * (n - e) / e;
    ++cells;
  };
  for (size_t i = 0; i < counts.size(); ++i) {
    if (expected[i] <= 0 && counts[i] > 0) return 0;
    if (expected[i] >= 10) {
      add(counts[i], expected[i]);
    } else {
      pooled_count += counts[i];
      pooled_expected += expected[i];
    }
  }
  if (pooled_expected >= 10) {
    add(pooled_count, pooled_expected);
  } else if (pooled_count > 10 + 10 * pooled_expected) {
    return 0;  // mass where there should be next to none
  }
  return cells > 1 ? ChiSquaredTail(statistic, cells - 1) : 1;
}

double RateTail(uint64_t hits, uint64_t trials, double rate) {
  const auto k = static_cast<double>(hits), n = static_cast<double>(trials);
  return hits == 0 ? 1 : Beta(k, n - k + 1, rate);
}

Interval RateInterval(uint64_t hits, uint64_t trials, double confidence) {
  const double tail = (1 - confidence) / 2;
  const auto k = static_cast<double>(hits), n = static_cast<double>(trials);
  Interval interval{0, 1};
  if (hits > 0) {
    interval.low = Bisect(0, 1, -tail, [&](double rate) { return -RateTail(hits, trials, rate); });
  }
  if (hits < trials) {  // rates this high give so few hits too seldom
    interval.high = Bisect(0, 1, tail, [&](double rate) { return 1 - Beta(k + 1, n - k, rate); });
  }
  return interval;
}

double Mean::Error() const {
  return count_ < 2 ? 0 : std::sqrt(squares_ / (count_ - 1) / count_);
}

double Mean::Z(double truth, double rounding) const {
  return std::abs(mean_ - truth) / std::hypot(Error(), rounding * truth);
}

double MeanTail(const Mean& mean, double truth, double slack) {
  return ExcessTail(mean.Value() - truth, slack, mean.Error(), std::max(mean.Count() - 1, 1.0));
}

double WelchTail(const Mean& a, const Mean& b, double slack) {
  const double va = a.Error() * a.Error(), vb = b.Error() * b.Error();
  const double degrees =
      va + vb > 0 ? (va + vb) * (va + vb) / (va * va / (a.Count() - 1) + vb * vb / (b.Count() - 1))
                  : 1;
  return ExcessTail(a.Value() - b.Value(), slack, std::sqrt(va + vb), degrees);
}

}  // namespace carpool::test
