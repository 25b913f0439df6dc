// From linear radiance to display codes: exposure, the Khronos PBR Neutral tone mapper, sRGB.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "render/image/srgb_encode.h"

namespace carpool::render {

using LinearRgb = std::array<float, 3>;

/// Khronos PBR Neutral: colours below 0.8 pass unchanged but for the removal of 4 % Fresnel
/// reflection, brighter ones are compressed towards white. Source: Khronos Group, "PBR Neutral Tone
/// Mapper", github.com/KhronosGroup/ToneMapping/tree/main/PBR_Neutral. Takes finite values >= 0,
/// gives [0, 1].
inline LinearRgb PbrNeutral(LinearRgb color) {
  constexpr float kStartCompression = 0.8f - 0.04f;
  constexpr float kDesaturation = 0.15f;
  const float least = std::min({color[0], color[1], color[2]});
  const float offset = least < 0.08f ? least - 6.25f * least * least : 0.04f;
  for (float& channel : color) channel -= offset;
  const float peak = std::max({color[0], color[1], color[2]});
  if (peak < kStartCompression) return color;
  constexpr float kRange = 1 - kStartCompression;
  const float new_peak = 1 - kRange * kRange / (peak + kRange - kStartCompression);
  const float white = 1 - 1 / (kDesaturation * (peak - new_peak) + 1);
  for (float& channel : color) {
    channel *= new_peak / peak;
    channel += white * (new_peak - channel);
  }
  return color;
}

/// The display code of a radiance times `exposure` (see ExposureScale). NaN and negative channels
/// count as 0, infinite ones as very bright.
inline std::array<uint8_t, 3> Tonemap(LinearRgb radiance, float exposure) {
  for (float& channel : radiance) {
    const float exposed = channel * exposure;
    channel = exposed > 0 ? std::min(exposed, 1e9f) : 0;  // the comparison is false for NaN
  }
  const Srgb8Encoder& encode = Srgb8Encoder::Instance();
  const LinearRgb mapped = PbrNeutral(radiance);
  return {encode(mapped[0]), encode(mapped[1]), encode(mapped[2])};
}

/// 2^EV.
inline float ExposureScale(float ev) {
  return std::exp2(ev);
}

}  // namespace carpool::render
