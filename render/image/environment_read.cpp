// See environment_read.h.
#include "render/image/environment_read.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>

#include "render/image/environment_codecs.h"
#include "render/image/file_read.h"
#include "render/image/image_codecs.h"

namespace carpool::render {
namespace {

bool IsExr(std::span<const std::byte> bytes) {
  constexpr std::array<std::byte, 4> kMagic = {std::byte{0x76}, std::byte{0x2f}, std::byte{0x31},
                                               std::byte{0x01}};
  return bytes.size() >= 4 && std::ranges::equal(bytes.first(4), kMagic);
}
bool IsRgbe(std::span<const std::byte> bytes) {
  return bytes.size() >= 2 && bytes[0] == std::byte{'#'} && bytes[1] == std::byte{'?'};
}

RawEnvironment ReadRaw(std::span<const std::byte> bytes, const std::string& where) {
  if (IsExr(bytes)) return ReadExrEnvironment(bytes, where);
  if (IsRgbe(bytes)) return ReadRgbe(bytes, where);
  throw InputError(where, "is neither a Radiance .hdr nor an OpenEXR file");
}

/// True if the texel had to be changed.
bool Sanitize(std::span<float, 3> texel) {
  const auto finite = [](float channel) { return std::isfinite(channel); };
  if (!std::ranges::all_of(texel, finite)) {
    std::ranges::fill(texel, 0.0f);
    return true;
  }
  bool changed = false;
  for (float& channel : texel) {
    changed = changed || channel < 0;
    channel = std::max(channel, 0.0f);
  }
  return changed;
}

/// The matrix to Rec.709, unless none is needed. Primaries that make no sense are ignored, because
/// a wrong hue is better than no picture.
std::optional<Matrix3> ConversionOf(const Primaries& primaries, const std::string& where,
                                    const WarningSink& warn) {
  if (primaries.IsNear(Primaries{})) return {};
  try {
    return ToRec709(primaries);
  } catch (const std::domain_error& error) {
    if (warn) warn(where + ": " + error.what() + "; Rec.709 is assumed");
    return {};
  }
}

/// True if the colour left the gamut.
bool Convert(const Matrix3& matrix, std::span<float, 3> texel) {
  const std::array<double, 3> source = {texel[0], texel[1], texel[2]};
  bool clamped = false;
  for (size_t i = 0; i < 3; ++i) {
    const double value =
        matrix[i][0] * source[0] + matrix[i][1] * source[1] + matrix[i][2] * source[2];
    const double brightest = std::max({source[0], source[1], source[2]});
    clamped = clamped || value < -1e-4 * brightest;  // not for rounding in the stated primaries
    texel[i] = static_cast<float>(std::clamp(value, 0.0, 3.4e38));
  }
  return clamped;
}

template <class Change>
int64_t CountChanged(std::vector<float>& rgb, const Change& change) {
  int64_t count = 0;
  for (size_t i = 0; i < rgb.size(); i += 3) {
    count += change(std::span<float, 3>(rgb.data() + i, 3)) ? 1 : 0;
  }
  return count;
}

void Warn(const EnvironmentMap& map, const std::string& where, const WarningSink& warn) {
  if (!warn) return;
  if (map.rejected_texels != 0) {
    warn(where + ": " + std::to_string(map.rejected_texels) +
         " texels are NaN, infinite or negative and count as 0");
  }
  if (map.clamped_texels != 0) {
    warn(where + ": " + std::to_string(map.clamped_texels) +
         " texels have colours outside Rec.709 and were clamped");
  }
}

}  // namespace

void CheckEnvironmentSize(int64_t width, int64_t height, const std::string& where) {
  CheckImageSize(width, height, where);
  if (width * height > kMaxEnvironmentPixels) {
    throw InputError(where, "the environment map has more than " +
                                std::to_string(kMaxEnvironmentPixels) + " pixels; scale it down");
  }
}

EnvironmentMap ReadEnvironment(const std::filesystem::path& path, const WarningSink& warn) {
  return DecodeEnvironment(ReadWholeFile(path), path.string(), warn);
}

EnvironmentMap DecodeEnvironment(std::span<const std::byte> bytes, const std::string& where,
                                 const WarningSink& warn) {
  RawEnvironment raw = ReadRaw(bytes, where);
  EnvironmentMap map{raw.width, raw.height, std::move(raw.rgb)};
  map.rejected_texels = CountChanged(map.rgb, Sanitize);
  if (const auto matrix = ConversionOf(raw.primaries, where, warn)) {
    map.clamped_texels =
        CountChanged(map.rgb, [&](std::span<float, 3> texel) { return Convert(*matrix, texel); });
  }
  Warn(map, where, warn);
  return map;
}

}  // namespace carpool::render
