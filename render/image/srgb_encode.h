// Linear light to the nearest 8-bit sRGB code, exactly and without a power per value.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stages/tables/srgb.h"

namespace carpool::render {

/// The code whose encoded value is nearest. Below 0 and NaN give 0, above 1 gives 255.
class Srgb8Encoder {
 public:
  Srgb8Encoder() {
    for (size_t code = 0; code < 255; ++code) {
      threshold_[code] =
          static_cast<float>(stages::SrgbToLinear((static_cast<double>(code) + 0.5) / 255));
    }
    threshold_[255] = 2;  // never reached
    size_t code = 0;
    for (size_t i = 0; i < first_.size(); ++i) {
      while (threshold_[code] <= static_cast<float>(i) / kBuckets) ++code;
      first_[i] = static_cast<uint8_t>(code);
    }
  }

  uint8_t operator()(float linear) const {
    if (!(linear > 0)) return 0;
    if (linear >= 1) return 255;
    const uint8_t code = first_[static_cast<size_t>(linear * kBuckets)];
    return static_cast<uint8_t>(code + (linear >= threshold_[code] ? 1 : 0));
  }

  /// One table for the whole program.
  static const Srgb8Encoder& Instance() {
    static const Srgb8Encoder encoder;
    return encoder;
  }

 private:
  // The steepest step is 1/3294: at most one begins in a bucket.
  static constexpr float kBuckets = 4096;
  std::array<float, 256> threshold_{};  // from here on the next code is nearer
  std::array<uint8_t, 4096> first_{};   // the code at the beginning of each bucket
};

}  // namespace carpool::render
