// Arithmetic on 3x4 matrices in double, as node transforms need it.
#pragma once

#include <array>
#include <cmath>

#include "render/gltf/gltf.h"

namespace carpool::render::gltf {

using Vec3 = std::array<double, 3>;

inline constexpr Affine kIdentity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

inline Vec3 Subtract(const Vec3& a, const Vec3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Vec3 Scale(const Vec3& a, double s) {
  return {a[0] * s, a[1] * s, a[2] * s};
}
inline Vec3 Add(const Vec3& a, const Vec3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline double Dot(const Vec3& a, const Vec3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vec3 Cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Unit vector along `v`, or `otherwise` where `v` has no direction (zero or not finite). Scales
/// first, so that neither tiny nor huge vectors lose theirs to underflow or overflow.
inline Vec3 NormalizeOr(const Vec3& v, const Vec3& otherwise) {
  const double largest = std::fmax(std::fabs(v[0]), std::fmax(std::fabs(v[1]), std::fabs(v[2])));
  if (!(largest > 0) || !std::isfinite(v[0] + v[1] + v[2])) return otherwise;
  const Vec3 scaled = {v[0] / largest, v[1] / largest, v[2] / largest};
  return Scale(scaled, 1 / std::sqrt(Dot(scaled, scaled)));
}

/// Some unit vector perpendicular to the unit vector `n`.
inline Vec3 AnyPerpendicular(const Vec3& n) {
  const Vec3 axis = std::fabs(n[0]) < 0.5 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  return NormalizeOr(Cross(Cross(n, axis), n), {1, 0, 0});
}

inline Affine Multiply(const Affine& a, const Affine& b) {
  Affine out;
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 4; ++col) {
      double sum = col == 3 ? a[row * 4 + 3] : 0;
      for (int k = 0; k < 3; ++k) sum += a[row * 4 + k] * b[k * 4 + col];
      out[row * 4 + col] = sum;
    }
  }
  return out;
}

inline Vec3 TransformVector(const Affine& m, const Vec3& v) {
  return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[4] * v[0] + m[5] * v[1] + m[6] * v[2],
          m[8] * v[0] + m[9] * v[1] + m[10] * v[2]};
}

inline Vec3 TransformPoint(const Affine& m, const Vec3& p) {
  return Add(TransformVector(m, p), {m[3], m[7], m[11]});
}

/// A normal through the cofactors of the 3x3 part: right for any scale, also where no inverse
/// exists.
inline Vec3 TransformNormal(const Affine& m, const Vec3& n) {
  const Vec3 x = {m[0], m[4], m[8]}, y = {m[1], m[5], m[9]}, z = {m[2], m[6], m[10]};
  return Add(Add(Scale(Cross(y, z), n[0]), Scale(Cross(z, x), n[1])), Scale(Cross(x, y), n[2]));
}

inline double Determinant(const Affine& m) {
  return Dot(Cross({m[0], m[4], m[8]}, {m[1], m[5], m[9]}), {m[2], m[6], m[10]});
}

/// Translation x rotation x scale; `q` is a unit quaternion (x, y, z, w).
inline Affine FromTrs(const Vec3& t, const std::array<double, 4>& q, const Vec3& s) {
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  return {(1 - 2 * (y * y + z * z)) * s[0], 2 * (x * y - z * w) * s[1],
          2 * (x * z + y * w) * s[2],       t[0],
          2 * (x * y + z * w) * s[0],       (1 - 2 * (x * x + z * z)) * s[1],
          2 * (y * z - x * w) * s[2],       t[1],
          2 * (x * z - y * w) * s[0],       2 * (y * z + x * w) * s[1],
          (1 - 2 * (x * x + y * y)) * s[2], t[2]};
}

inline bool IsFinite(const Affine& m) {
  for (double value : m) {
    if (!std::isfinite(value)) return false;
  }
  return true;
}

}  // namespace carpool::render::gltf
