// Kolmogorov's test and the weighted mean of relative errors.
#include "tests/support/evidence.h"

#include <algorithm>
#include <cmath>

namespace carpool::test {
namespace {

constexpr double kPower = 2.33;   // deviate of power 0.99
constexpr double kSingle = 1e-9;  // false-alarm rate of a single mean

}  // namespace

void Evidence::Add(const Mean& mean, double truth) {
  const double error = mean.Error() / truth;
  p_values_.push_back(MeanTail(mean, truth, 0));
  errors_.push_back(error);
  degrees_ = mean.Count() - 1;
  sum_ += (mean.Value() / truth - 1) / (error * error);
  weight_ += 1 / (error * error);
}

bool Evidence::IsUniform() const {
  if (p_values_.empty()) return true;
  const auto n = static_cast<double>(count());
  return KolmogorovTail(DistanceFromUniform(p_values_), n) >= kFalseAlarm;
}

double Evidence::SmallestDistance() const {
  if (p_values_.empty()) return 1;
  const auto n = static_cast<double>(count());
  // A share of values is known to half a root of their number at worst.
  return std::min(1.0, KolmogorovDistance(kFalseAlarm, n) + kPower * 0.5 / std::sqrt(n));
}

double Evidence::CommonBias() const {
  return weight_ > 0 ? sum_ / weight_ : 0;
}

double Evidence::CommonError() const {
  if (weight_ <= 0) return 0;
  // Weights are estimates, too, which costs this much (Meier 1953, to first order).
  return std::sqrt((1 + 4 / degrees_) / weight_);
}

bool Evidence::IsUnbiased(double slack) const {
  return std::abs(CommonBias()) <= slack + kLargestZ * CommonError();
}

double Evidence::SmallestCommonBias() const {
  return weight_ > 0 ? (kLargestZ + kPower) * CommonError() : 1;
}

double Evidence::SmallestSingleBias() const {
  if (errors_.empty()) return 1;
  std::vector<double> errors = errors_;
  const auto middle = errors.begin() + static_cast<ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return (StudentQuantile(kSingle, degrees_) + kPower) * *middle;
}

}  // namespace carpool::test
