// Builds the albedo tables: only + - * / and sqrt in a fixed order, so every machine gets the same
// bits.
#include "stages/tables/bsdf_tables.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace carpool::stages {
namespace {

double Fifth(double x) {
  return x * x * x * x * x;
}

/// cos((j + 1/2) pi / n) for j < n, from half-angle formulas and rotation; n is a power of two.
std::vector<double> HalfTurnCosines(int n) {
  double cosine = 0, sine = 1;  // a quarter turn, halved until it is pi / 2n
  for (int k = n; k > 1; k /= 2) {
    sine = std::sqrt((1 - cosine) / 2);
    cosine = std::sqrt((1 + cosine) / 2);
  }
  const double step_cosine = cosine * cosine - sine * sine;
  const double step_sine = 2 * sine * cosine;
  std::vector<double> cosines;
  for (int j = 0; j < n; ++j) {
    cosines.push_back(cosine);
    const double next = cosine * step_cosine - sine * step_sine;
    sine = sine * step_cosine + cosine * step_sine;
    cosine = next;
  }
  return cosines;
}

/// log2 of x >= 1 to 1e-9, one bit at a time: squaring doubles the logarithm.
double Log2(double x) {
  double result = 0;
  for (; x >= 2; x /= 2) result += 1;
  for (double bit = 0.5; bit > 1e-9; bit /= 2) {
    x *= x;
    if (x >= 2) {
      x /= 2;
      result += bit;
    }
  }
  return result;
}

/// Sums over the azimuths of one cap height: integrands of A + B and of B.
struct Ring {
  double all = 0, fresnel = 0;
};

/// One outgoing direction, stretched for visible-normal sampling (Dupuy and Benyoub 2023).
struct Outgoing {
  double mu, sine, alpha, stretched_x, stretched_z, smith;
};

Ring SumRing(const Outgoing& o, double height, const std::vector<double>& cosines) {
  const double above = height * (1 + o.stretched_z);
  const double below = (1 - height) * (1 + o.stretched_z);
  const double sine = std::sqrt(std::max(0.0, below * (2 - below)));
  Ring ring;
  for (const double c : cosines) {
    const double x = o.alpha * (sine * c + o.stretched_x);
    const double y2 = o.alpha * o.alpha * sine * sine * (1 - c * c);
    const double length2 = x * x + y2 + above * above;
    const double dot = o.sine * x + o.mu * above;
    const double mu_in = 2 * dot * above / length2 - o.mu;
    if (mu_in <= 0) continue;
    const double smith_in = std::sqrt(mu_in * mu_in + o.alpha * o.alpha * (1 - mu_in * mu_in));
    const double weight =
        mu_in * (o.mu + o.smith) / (o.mu * smith_in + mu_in * o.smith);  // G2 / G1
    ring.all += weight;
    ring.fresnel += weight * Fifth(1 - dot / std::sqrt(length2));
  }
  return ring;
}

AlbedoPair Integrate(double mu, double alpha, int heights, const std::vector<double>& cosines) {
  Outgoing o;
  o.mu = std::max(mu, 1e-9);
  o.sine = std::sqrt(std::max(0.0, 1 - o.mu * o.mu));
  o.alpha = alpha;
  const double length = std::sqrt(alpha * alpha * o.sine * o.sine + o.mu * o.mu);
  o.stretched_x = alpha * o.sine / length;
  o.stretched_z = o.mu / length;
  o.smith = length;
  Ring sum;
  double weights = 0;
  for (int i = 0; i < heights; ++i) {
    // Cubed, because what roughness changes lies near the horizon of the stretched hemisphere.
    const double v = (i + 0.5) / heights;
    const Ring ring = SumRing(o, v * v * v, cosines);
    sum.all += v * v * ring.all;
    sum.fresnel += v * v * ring.fresnel;
    weights += v * v;
  }
  const double scale = 1.0 / (weights * static_cast<double>(cosines.size()));
  return {std::max(0.0, 1 - sum.all * scale), sum.fresnel * scale};
}

double NodeRoughness(int i, int count) {
  return kMinRoughness + (1 - kMinRoughness) * i / (count - 1);
}

double InverseCoordinate(double coordinate, double alpha) {
  double low = 0, high = 1;
  for (int step = 0; step < 48; ++step) {
    const double middle = 0.5 * (low + high);
    (AlbedoCoordinate(middle, alpha) < coordinate ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

int32_t Pack(double mu, const AlbedoPair& e) {
  const double c = e.b - (1 - e.m) * Fifth(1 - mu);
  const auto m_bits =
      static_cast<uint32_t>(std::floor(std::clamp(e.m, 0.0, 1.0) / kAlbedoUnitM + 0.5));
  const auto c_bits =
      static_cast<uint32_t>(std::floor((std::clamp(c, -1.0, 1.0) + 1) / kAlbedoUnitC + 0.5));
  return static_cast<int32_t>((m_bits << 16) | c_bits);
}

/// 2 * integral of mu f(mu), of the table as it is interpolated: layers then conserve energy
/// exactly.
AlbedoPair Average(const BsdfTables& tables, double roughness) {
  constexpr int kSteps = 512;
  AlbedoPair sum{0, 0};
  for (int i = 0; i < kSteps; ++i) {
    // mu = t^3: many points where a smooth surface's M changes.
    const double t = (i + 0.5) / kSteps;
    const double mu = t * t * t;
    const double weight = 2 * mu * 3 * t * t / kSteps;
    const AlbedoPair e = InterpolateAlbedo(tables, mu, roughness);
    sum.m += weight * e.m;
    sum.b += weight * e.b;
  }
  return sum;
}

BsdfTables Build() {
  constexpr int kHeights = 40;
  constexpr int kAzimuths = 32;
  const std::vector<double> cosines = HalfTurnCosines(kAzimuths);
  BsdfTables tables;
  for (int i = 0; i < kAlbedoRoughnesses; ++i) {
    const double roughness = NodeRoughness(i, kAlbedoRoughnesses);
    const double alpha = roughness * roughness;
    for (int j = 0; j < kAlbedoCosines; ++j) {
      const double mu = InverseCoordinate(static_cast<double>(j) / (kAlbedoCosines - 1), alpha);
      tables.albedo[i * kAlbedoCosines + j] = Pack(mu, Integrate(mu, alpha, kHeights, cosines));
    }
  }
  for (int i = 0; i < kAverageRoughnesses; ++i) {
    const double roughness = NodeRoughness(i, kAverageRoughnesses);
    const AlbedoPair average = Average(tables, roughness);
    const double alpha = roughness * roughness;
    float* columns = &tables.average[i * kAverageColumns];
    columns[0] = static_cast<float>(average.m);
    columns[1] = static_cast<float>(average.b);
    columns[2] = static_cast<float>(Log2(1 + 1 / (kSpreadPerAlpha2 * alpha * alpha)));
    columns[3] = 0;
  }
  return tables;
}

}  // namespace

const BsdfTables& SharedBsdfTables() {
  static const BsdfTables tables = Build();
  return tables;
}

AlbedoPair IntegrateAlbedo(double mu, double alpha, int heights, int azimuths) {
  return Integrate(mu, alpha, heights, HalfTurnCosines(azimuths));
}

AlbedoPair InterpolateAlbedo(const BsdfTables& tables, double mu, double roughness) {
  roughness = std::clamp(roughness, kMinRoughness, 1.0);
  const double row = (roughness - kMinRoughness) / (1 - kMinRoughness) * (kAlbedoRoughnesses - 1);
  const double column = AlbedoCoordinate(mu, roughness * roughness) * (kAlbedoCosines - 1);
  const int i = std::min(static_cast<int>(row), kAlbedoRoughnesses - 2);
  const int j = std::min(static_cast<int>(column), kAlbedoCosines - 2);
  double m = 0, c = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const int di = corner / 2, dj = corner % 2;
    const auto word = static_cast<uint32_t>(tables.albedo[(i + di) * kAlbedoCosines + j + dj]);
    const double weight = (di ? row - i : 1 - (row - i)) * (dj ? column - j : 1 - (column - j));
    m += weight * (word >> 16) * kAlbedoUnitM;
    c += weight * ((word & 0xffff) * kAlbedoUnitC - 1);
  }
  return {m, c + (1 - m) * Fifth(1 - mu)};
}

}  // namespace carpool::stages
