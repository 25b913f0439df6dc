// See texture_reference.h.
#include "tests/stages/texture_reference.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace carpool::stages {
namespace {

using Rgba64 = std::array<double, 4>;

double DecodeSrgb(double x) {
  return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
}

/// Texel number `i` of a row or column of `n` as the wrap mode continues it.
int64_t WrapTexel(int64_t i, int64_t n, int32_t mode) {
  const auto modulo = [](int64_t a, int64_t b) { return ((a % b) + b) % b; };
  if (mode == kWrapClamp) return std::clamp<int64_t>(i, 0, n - 1);
  if (mode == kWrapRepeat) return modulo(i, n);
  const int64_t j = modulo(i, 2 * n);
  return j < n ? j : 2 * n - 1 - j;
}

struct LevelView {
  const TextureTables& tables;
  const Texture& texture;
  const TextureSlot& slot;
  int level;

  int64_t Width() const { return std::max(1, texture.width >> level); }
  int64_t Height() const { return std::max(1, texture.height >> level); }

  Rgba64 Texel(int64_t x, int64_t y) const {
    x = WrapTexel(x, Width(), slot.wrap_s);
    y = WrapTexel(y, Height(), slot.wrap_t);
    const bool wide = texture.format == TexelFormat::rgba16;
    const uint32_t* word =
        tables.words.data() + texture.level_offset[level] + (y * Width() + x) * (wide ? 2 : 1);
    Rgba64 out;
    for (int channel = 0; channel < 4; ++channel) {
      const double code = wide ? (word[channel / 2] >> (16 * (channel % 2))) & 0xffff
                               : (word[0] >> (8 * channel)) & 0xff;
      out[channel] = code / (wide ? 65535.0 : 255.0);
      if (texture.srgb != 0 && channel < 3) out[channel] = DecodeSrgb(out[channel]);
    }
    return out;
  }
};

double DistanceToInteger(double x) {
  return std::abs(x - std::round(x));
}

}  // namespace

ReferenceSample SampleReference(const TextureTables& tables, const TextureQuery& query) {
  const TextureSlot& slot = tables.slots[query.slot];
  const Texture& texture = tables.textures[slot.texture];
  ReferenceSample result;

  double u = query.u, v = query.v, stretch = 1;
  if (slot.has_transform != 0) {
    const float* m = slot.transform;
    u = double{m[0]} * query.u + double{m[1]} * query.v + m[2];
    v = double{m[3]} * query.u + double{m[4]} * query.v + m[5];
    stretch = std::sqrt(std::abs(double{m[0]} * m[4] - double{m[1]} * m[3]));
  }

  const double lod =
      query.log2_footprint +
      std::log2(std::max(1e-15, stretch * std::sqrt(double(texture.width) * texture.height)));
  const bool minified = lod > 0;
  result.margin = std::abs(lod);
  int level = 0;
  if (minified && (slot.filter & kFilterMipNone) == 0) {
    const double bounded = std::min(lod, double(texture.levels - 1));
    const double threshold = (slot.filter & kFilterMipNearest) != 0 ? 0.5 : query.u_level;
    const double fraction = bounded - std::floor(bounded);
    level = int(std::floor(bounded)) + (fraction > threshold ? 1 : 0);
    if (lod < texture.levels - 1) {
      result.margin =
          std::min({result.margin, std::abs(fraction - threshold), DistanceToInteger(lod)});
    }
  }

  const LevelView view{tables, texture, slot, level};
  const bool nearest = (slot.filter & (minified ? kFilterMinNearest : kFilterMagNearest)) != 0;
  const double x = u * double(view.Width()), y = v * double(view.Height());
  if (nearest) {
    result.margin = std::min({result.margin, DistanceToInteger(x), DistanceToInteger(y)});
    result.rgba = view.Texel(int64_t(std::floor(x)), int64_t(std::floor(y)));
    return result;
  }
  const int64_t x0 = int64_t(std::floor(x - 0.5)), y0 = int64_t(std::floor(y - 0.5));
  const double fx = x - 0.5 - double(x0), fy = y - 0.5 - double(y0);
  for (int channel = 0; channel < 4; ++channel) {
    const double top =
        (1 - fx) * view.Texel(x0, y0)[channel] + fx * view.Texel(x0 + 1, y0)[channel];
    const double bottom =
        (1 - fx) * view.Texel(x0, y0 + 1)[channel] + fx * view.Texel(x0 + 1, y0 + 1)[channel];
    result.rgba[channel] = (1 - fy) * top + fy * bottom;
  }
  return result;
}

}  // namespace carpool::stages
