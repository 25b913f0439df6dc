// The texture look-up as one would write it in plain scalar C++: what the one-lane kernel is held
// to.
//
// Same rules as stages/kernels/texture-inl.h, with branches where a scalar program branches. It is
// compiled once per SIMD target, so that both sides may use the same instructions.

#if defined(CARPOOL_STAGES_BENCH_PLAIN_TEXTURE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_BENCH_PLAIN_TEXTURE_INL_H_
#undef CARPOOL_STAGES_BENCH_PLAIN_TEXTURE_INL_H_
#else
#define CARPOOL_STAGES_BENCH_PLAIN_TEXTURE_INL_H_
#endif

#include "stages/bench/plain_kernels-inl.h"
#include "stages/tables/texture_view.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {
namespace plain {

struct Float4 {
  float r, g, b, a;
};

inline float Log2(float x) {
  const uint32_t bits = std::bit_cast<uint32_t>(x);
  const float exponent = static_cast<float>(static_cast<int32_t>(bits >> 23) - 127);
  const float t = std::bit_cast<float>((bits & 0x7fffffu) | 0x3f800000u) - 1;
  float q = Fma(0.0451482938f, t, -0.193573782f);
  q = Fma(q, t, 0.41560437f);
  q = Fma(q, t, -0.709095857f);
  q = Fma(q, t, 1.441916975f);
  return Fma(t, q, exponent);
}

inline float WrapUnit(float u, int32_t mode) {
  if (mode == kWrapRepeat) return u - std::floor(u);
  if (mode == kWrapClamp) return std::min(std::max(u, 0.0f), 1.0f);
  const float period = u - 2 * std::floor(u * 0.5f);
  return std::min(period, 2 - period);
}

struct Axis {
  int32_t low, high;
  float weight;
};
inline Axis ResolveAxis(float u, int32_t wrap, int32_t size, bool nearest) {
  const float x = WrapUnit(u, wrap) * static_cast<float>(size);
  if (nearest) {
    const int32_t texel = std::min(static_cast<int32_t>(x), size - 1);
    return {texel, texel, 0};
  }
  const float position = x - 0.5f, low = std::floor(position);
  const int32_t first = static_cast<int32_t>(low), second = first + 1;
  return {first >= 0            ? first
          : wrap == kWrapRepeat ? size - 1
                                : 0,
          second < size         ? second
          : wrap == kWrapRepeat ? 0
                                : size - 1,
          position - low};
}

inline Float4 ReadTexel(const TextureTablesView& t, const Texture& image, int32_t offset,
                        int32_t texel) {
  if (image.format == TexelFormat::rgba16) {
    const uint32_t* word = t.words + offset + 2 * texel;
    const uint32_t r = word[0] & 0xffff, g = word[0] >> 16, b = word[1] & 0xffff, a = word[1] >> 16;
    constexpr float kUnit = 1.0f / 65535;
    if (image.srgb != 0) {
      return {t.srgb16[r], t.srgb16[g], t.srgb16[b], static_cast<float>(a) * kUnit};
    }
    return {static_cast<float>(r) * kUnit, static_cast<float>(g) * kUnit,
            static_cast<float>(b) * kUnit, static_cast<float>(a) * kUnit};
  }
  const uint32_t word = t.words[offset + texel];
  const uint32_t r = word & 0xff, g = (word >> 8) & 0xff, b = (word >> 16) & 0xff, a = word >> 24;
  constexpr float kUnit = 1.0f / 255;
  if (image.srgb != 0) {
    return {t.srgb8[r], t.srgb8[g], t.srgb8[b], static_cast<float>(a) * kUnit};
  }
  return {static_cast<float>(r) * kUnit, static_cast<float>(g) * kUnit,
          static_cast<float>(b) * kUnit, static_cast<float>(a) * kUnit};
}

inline Float4 Mix(const Float4& a, const Float4& b, float t) {
  return {Fma(b.r - a.r, t, a.r), Fma(b.g - a.g, t, a.g), Fma(b.b - a.b, t, a.b),
          Fma(b.a - a.a, t, a.a)};
}

inline int32_t ChooseLevel(const TextureSlot& slot, const Texture& image, float lod,
                           float u_level) {
  if ((slot.filter & kFilterMipNone) != 0 || !(lod > 0)) return 0;
  const float last = static_cast<float>(image.levels - 1), bounded = std::min(lod, last);
  const float low = std::floor(bounded);
  const float threshold = (slot.filter & kFilterMipNearest) != 0 ? 0.5f : u_level;
  const int32_t level = static_cast<int32_t>(low) + (threshold < bounded - low ? 1 : 0);
  return std::min(level, image.levels - 1);
}

/// Not inlined, as in any program that reads several slots.
inline HWY_NOINLINE Float4 SampleTexture(const TextureTablesView& t, int32_t index, Float2 uv,
                                         float log2_footprint, float u_level) {
  const TextureSlot& slot = t.slots[index];
  const Texture& image = t.textures[slot.texture];
  float u = uv.x, v = uv.y, stretch = 1;
  if (slot.has_transform != 0) {
    const float* m = slot.transform;
    u = Fma(m[0], uv.x, Fma(m[1], uv.y, m[2]));
    v = Fma(m[3], uv.x, Fma(m[4], uv.y, m[5]));
    stretch = std::abs(m[0] * m[4] - m[1] * m[3]);
  }
  if (!(std::abs(u) <= 1e9f)) u = 0;
  if (!(std::abs(v) <= 1e9f)) v = 0;
  const float area = std::max(
      static_cast<float>(image.width) * static_cast<float>(image.height) * stretch, 1e-30f);
  const float lod = Fma(0.5f, Log2(area), log2_footprint);
  const int32_t level = ChooseLevel(slot, image, lod, u_level);
  const bool nearest = (slot.filter & (lod > 0 ? kFilterMinNearest : kFilterMagNearest)) != 0;
  const int32_t width = std::max(image.width >> level, 1),
                height = std::max(image.height >> level, 1);
  const int32_t offset = image.level_offset[level];
  const Axis x = ResolveAxis(u, slot.wrap_s, width, nearest),
             y = ResolveAxis(v, slot.wrap_t, height, nearest);
  const Float4 top_left = ReadTexel(t, image, offset, y.low * width + x.low);
  if (nearest) return top_left;
  const Float4 top_right = ReadTexel(t, image, offset, y.low * width + x.high),
               bottom_left = ReadTexel(t, image, offset, y.high * width + x.low),
               bottom_right = ReadTexel(t, image, offset, y.high * width + x.high);
  return Mix(Mix(top_left, top_right, x.weight), Mix(bottom_left, bottom_right, x.weight),
             y.weight);
}

}  // namespace plain
}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
