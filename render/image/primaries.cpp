// See primaries.h.
#include "render/image/primaries.h"

#include <cmath>
#include <stdexcept>

namespace carpool::render {
namespace {

using Vector3 = std::array<double, 3>;

Matrix3 Multiply(const Matrix3& a, const Matrix3& b) {
  Matrix3 out{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      for (size_t k = 0; k < 3; ++k) out[i][j] += a[i][k] * b[k][j];
    }
  }
  return out;
}

Vector3 Apply(const Matrix3& m, const Vector3& v) {
  Vector3 out{};
  for (size_t i = 0; i < 3; ++i) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return out;
}

Matrix3 Invert(const Matrix3& m) {
  Matrix3 cofactors;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      const size_t a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
      cofactors[j][i] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
    }
  }
  const double determinant =
      m[0][0] * cofactors[0][0] + m[0][1] * cofactors[1][0] + m[0][2] * cofactors[2][0];
  if (!(std::abs(determinant) > 1e-9)) {
    throw std::domain_error("the chromaticities span no colour space");
  }
  for (auto& row : cofactors) {
    for (double& entry : row) entry /= determinant;
  }
  return cofactors;
}

/// XYZ of a chromaticity at Y = 1.
Vector3 Xyz(const std::array<double, 2>& xy) {
  if (!(std::abs(xy[1]) > 1e-9)) throw std::domain_error("a chromaticity has y = 0");
  return {xy[0] / xy[1], 1, (1 - xy[0] - xy[1]) / xy[1]};
}

/// Scales the columns so that RGB (1, 1, 1) is the white point.
Matrix3 ToXyz(const Primaries& p) {
  Matrix3 m;
  const std::array columns = {p.red, p.green, p.blue};
  for (size_t j = 0; j < 3; ++j) {
    const auto& [x, y] = columns[j];
    m[0][j] = x;
    m[1][j] = y;
    m[2][j] = 1 - x - y;
  }
  const Vector3 scale = Apply(Invert(m), Xyz(p.white));
  for (auto& row : m) {
    for (size_t j = 0; j < 3; ++j) row[j] *= scale[j];
  }
  return m;
}

Matrix3 Adapt(const std::array<double, 2>& from, const std::array<double, 2>& to) {
  constexpr Matrix3 kBradford = {
      {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};
  const Vector3 source = Apply(kBradford, Xyz(from)), target = Apply(kBradford, Xyz(to));
  Matrix3 scale{};
  for (size_t i = 0; i < 3; ++i) scale[i][i] = target[i] / source[i];
  return Multiply(Invert(kBradford), Multiply(scale, kBradford));
}

}  // namespace

bool Primaries::IsNear(const Primaries& other) const {
  const auto near = [](const std::array<double, 2>& a, const std::array<double, 2>& b) {
    return std::abs(a[0] - b[0]) < 1e-3 && std::abs(a[1] - b[1]) < 1e-3;
  };
  return near(red, other.red) && near(green, other.green) && near(blue, other.blue) &&
         near(white, other.white);
}

Matrix3 ToRec709(const Primaries& source) {
  const Primaries rec709;
  return Multiply(Invert(ToXyz(rec709)),
                  Multiply(Adapt(source.white, rec709.white), ToXyz(source)));
}

}  // namespace carpool::render
