// Computes the pixel filter's table while compiling: the same numbers on every machine.
#include "stages/sampling/filter_table.h"

namespace carpool::stages {
namespace {

// Four-term Blackman-Harris window (Harris 1978), centred on 0.
constexpr double kA0 = 0.35875, kA1 = 0.48829, kA2 = 0.14128, kA3 = 0.01168;
constexpr double kPi = 3.14159265358979323846;

/// Taylor series, good to 1e-15 on [-pi/2, pi/2].
constexpr double SinSeries(double x) {
  double term = x, sum = x;
  for (int n = 1; n <= 11; ++n) {
    term *= -x * x / ((2 * n) * (2 * n + 1));
    sum += term;
  }
  return sum;
}

/// Mass below t of the window on [-1, 1], for t in [0, 1].
constexpr double Cumulative(double t) {
  const double s = t <= 0.5 ? SinSeries(kPi * t) : SinSeries(kPi * (1 - t));
  const double c = SinSeries(kPi * (0.5 - t));
  const double sin2 = 2 * s * c;
  const double sin3 = s * (3 - 4 * s * s);
  return 0.5 + (kA0 * t + (kA1 * s + kA2 / 2 * sin2 + kA3 / 3 * sin3) / kPi) / (2 * kA0);
}

constexpr double InverseCumulative(double mass) {
  double low = 0, high = 1;
  for (int step = 0; step < 34; ++step) {
    const double middle = 0.5 * (low + high);
    (Cumulative(middle) < mass ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

constexpr PixelFilterKnots MakeKnots() {
  PixelFilterKnots knots{};
  constexpr int half = kPixelFilterCells / 2;
  for (int k = 1; k <= half; ++k) {
    const double t = k == half ? 1 : InverseCumulative(0.5 + 0.5 * k / half);
    knots[half + k] = static_cast<float>(kPixelFilterRadius * t);
    knots[half - k] = -knots[half + k];
  }
  return knots;
}

}  // namespace

constexpr PixelFilterKnots kPixelFilterKnots = MakeKnots();

}  // namespace carpool::stages
