// Converts RGB between colour primaries.
#pragma once

#include <array>

namespace carpool::render {

/// CIE xy of the primaries and the white point.
struct Primaries {
  std::array<double, 2> red = {0.64, 0.33};  // Rec.709 and D65
  std::array<double, 2> green = {0.30, 0.60};
  std::array<double, 2> blue = {0.15, 0.06};
  std::array<double, 2> white = {0.3127, 0.3290};

  bool IsNear(const Primaries& other) const;
};

using Matrix3 = std::array<std::array<double, 3>, 3>;

/// The matrix from `source` to Rec.709, white to white (Bradford adaptation). Throws
/// std::domain_error for primaries that span no colour space.
Matrix3 ToRec709(const Primaries& source);

}  // namespace carpool::render
