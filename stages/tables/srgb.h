// The sRGB transfer curve (IEC 61966-2-1), in double, and its decoding tables for 8 and 16 bits.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace carpool::stages {

/// Encoded value in [0, 1] to linear light.
inline double SrgbToLinear(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

/// Linear light in [0, 1] to the encoded value.
inline double LinearToSrgb(double linear) {
  return linear <= 0.0031308 ? linear * 12.92 : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

/// Linear light of each 8-bit code.
inline const std::array<float, 256>& SrgbDecode8() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> made{};
    for (size_t code = 0; code < made.size(); ++code) {
      made[code] = static_cast<float>(SrgbToLinear(static_cast<double>(code) / 255));
    }
    return made;
  }();
  return table;
}

/// Linear light of each 16-bit code: 256 KiB, made at the first call.
inline const std::vector<float>& SrgbDecode16() {
  static const std::vector<float> table = [] {
    std::vector<float> made(65536);
    for (size_t code = 0; code < made.size(); ++code) {
      made[code] = static_cast<float>(SrgbToLinear(static_cast<double>(code) / 65535));
    }
    return made;
  }();
  return table;
}

}  // namespace carpool::stages
