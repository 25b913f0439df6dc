// Unions and measures of light clusters.
#include "render/lights/light_cluster.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace carpool::render {
namespace {

constexpr double kPi = std::numbers::pi;

double Dot(const Point3& a, const Point3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

double Distance(const Point3& a, const Point3& b) {
  const Point3 d = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return std::sqrt(Dot(d, d));
}

struct Cone {
  Point3 axis;
  double theta;
};

/// `axis` turned by `angle` towards `to`, which is at `cos` from it; false where they are
/// (anti)parallel.
bool TurnTowards(Point3& axis, const Point3& to, double cos, double angle) {
  Point3 side;
  for (int i = 0; i < 3; ++i) side[i] = to[i] - cos * axis[i];
  const double length = std::sqrt(Dot(side, side));
  if (!(length > 1e-9)) return false;
  const double along = std::cos(angle), across = std::sin(angle) / length;
  for (int i = 0; i < 3; ++i) axis[i] = along * axis[i] + across * side[i];
  const double norm = std::sqrt(Dot(axis, axis));
  for (double& c : axis) c /= norm;
  return true;
}

/// Smallest cone about two (Conty Estevez & Kulla 2018, listing 1).
Cone UnionOfCones(Cone a, Cone b) {
  if (b.theta > a.theta) std::swap(a, b);
  if (a.theta >= kPi) return a;
  const double cos = std::clamp(Dot(a.axis, b.axis), -1.0, 1.0);
  const double between = std::acos(cos);
  if (std::min(between + b.theta, kPi) <= a.theta) return a;
  const double theta = (a.theta + between + b.theta) / 2;
  if (theta >= kPi) return {a.axis, kPi};
  if (!TurnTowards(a.axis, b.axis, cos, theta - a.theta)) {
    // Parallel axes whose angles differ by rounding keep the wider cone; opposite ones fill the
    // sphere.
    return cos > 0 ? a : Cone{a.axis, kPi};
  }
  return {a.axis, theta};
}

/// Solid angle of emission, weighted by its cosine (Conty Estevez & Kulla 2018, section 4.1).
double OrientationMeasure(const LightCluster& c) {
  const double o = c.theta_o, w = std::min(o + c.theta_e, kPi);
  return 2 * kPi * (1 - std::cos(o)) +
         kPi / 2 * (2 * w * std::sin(o) - std::cos(o - 2 * w) - 2 * o * std::sin(o) + std::cos(o));
}

}  // namespace

Point3 Center(const LightCluster& c) {
  return {(c.lo[0] + c.hi[0]) / 2, (c.lo[1] + c.hi[1]) / 2, (c.lo[2] + c.hi[2]) / 2};
}

LightCluster Union(const LightCluster& a, const LightCluster& b) {
  if (a.power <= 0) return b;
  if (b.power <= 0) return a;
  LightCluster u;
  for (int i = 0; i < 3; ++i) {
    u.lo[i] = std::min(a.lo[i], b.lo[i]);
    u.hi[i] = std::max(a.hi[i], b.hi[i]);
  }
  u.two_sided = a.two_sided || b.two_sided;
  Point3 other = b.axis;
  if (u.two_sided && Dot(a.axis, b.axis) < 0) {
    for (double& c : other)
      c = -c;  // both senses of the union's cone count, so the nearer one will do
  }
  const Cone cone = UnionOfCones({a.axis, a.theta_o}, {other, b.theta_o});
  u.axis = cone.axis;
  u.theta_o = cone.theta;
  u.theta_e = std::max(a.theta_e, b.theta_e);
  u.power = a.power + b.power;
  const Point3 center = Center(u);
  const double around_both =
      std::max(Distance(center, Center(a)) + a.radius, Distance(center, Center(b)) + b.radius);
  u.radius = std::min(around_both, Distance(u.lo, u.hi) / 2);
  return u;
}

double Cost(const LightCluster& c) {
  if (c.power <= 0) return 0;
  const double x = c.hi[0] - c.lo[0], y = c.hi[1] - c.lo[1], z = c.hi[2] - c.lo[2];
  // Lights in one line have no surface; a share of the squared diagonal still tells long from
  // short.
  const double area = 2 * (x * y + y * z + z * x) + 0.01 * (x * x + y * y + z * z);
  return c.power * OrientationMeasure(c) * area;
}

}  // namespace carpool::render
