// See mip_filter.h.
#include "render/image/mip_filter.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <vector>

#include "render/image/srgb_encode.h"

namespace carpool::render {
namespace {

using stages::TexelFormat;
using stages::Texture;

using Texel = std::array<float, 4>;  // straight colour in linear light, and alpha
using Level = std::vector<Texel>;

struct Size {
  int width, height;
};
Size SizeOf(const Texture& texture, int level) {
  return {std::max(1, texture.width >> level), std::max(1, texture.height >> level)};
}

/// The source texels under one destination texel along one axis, with weights that sum to 1.
struct Taps {
  int first = 0;
  int count = 1;
  std::array<float, 3> weight = {1, 0, 0};
};
std::vector<Taps> MakeTaps(int source, int target) {
  std::vector<Taps> taps(static_cast<size_t>(target));
  for (int i = 0; i < target; ++i) {
    Taps& tap = taps[static_cast<size_t>(i)];
    tap.first = source == target ? i : 2 * i;
    if (source == target) continue;
    const bool odd = source % 2 != 0;
    tap.count = odd ? 3 : 2;
    const auto total = static_cast<float>(source);
    const auto n = static_cast<float>(target), at = static_cast<float>(i);
    tap.weight = odd ? std::array<float, 3>{(n - at) / total, n / total, (at + 1) / total}
                     : std::array<float, 3>{0.5f, 0.5f, 0};
  }
  return taps;
}

/// Texels of one texture between words and linear light.
class Codec {
 public:
  explicit Codec(const Texture& texture)
      : wide_(texture.format == TexelFormat::rgba16), srgb_(texture.srgb != 0) {
    if (wide_ && srgb_) wide_table_ = stages::SrgbDecode16().data();
  }

  size_t WordsPerTexel() const { return wide_ ? 2 : 1; }

  Texel Read(const uint32_t* word) const {
    Texel texel;
    for (size_t channel = 0; channel < 4; ++channel) {
      const uint32_t code = wide_ ? word[channel / 2] >> (16 * (channel % 2)) & 0xffff
                                  : word[0] >> (8 * channel) & 0xff;
      texel[channel] = Decode(code, srgb_ && channel < 3);
    }
    return texel;
  }

  void Write(const Texel& texel, uint32_t* word) const {
    std::array<uint32_t, 4> code;
    for (size_t channel = 0; channel < 4; ++channel) {
      code[channel] = Encode(texel[channel], srgb_ && channel < 3);
    }
    if (wide_) {
      word[0] = code[0] | code[1] << 16;
      word[1] = code[2] | code[3] << 16;
    } else {
      word[0] = code[0] | code[1] << 8 | code[2] << 16 | code[3] << 24;
    }
  }

 private:
  float Decode(uint32_t code, bool srgb) const {
    if (!srgb) return static_cast<float>(code) / (wide_ ? 65535.0f : 255.0f);
    return wide_ ? wide_table_[code] : narrow_table_[code];
  }
  uint32_t Encode(float linear, bool srgb) const {
    if (srgb && !wide_) return encoder_(linear);
    const double encoded = srgb ? stages::LinearToSrgb(linear) : linear;
    return static_cast<uint32_t>(encoded * (wide_ ? 65535.0 : 255.0) + 0.5);
  }

  bool wide_, srgb_;
  const float* narrow_table_ = stages::SrgbDecode8().data();
  const float* wide_table_ = nullptr;
  const Srgb8Encoder& encoder_ = Srgb8Encoder::Instance();
};

/// Averages the source texels under two taps; `source(x, y)` gives one.
template <class Source>
Texel Average(const Taps& across, const Taps& down, bool alpha_weighted, const Source& source) {
  Texel plain{}, weighted{};
  for (int j = 0; j < down.count; ++j) {
    for (int i = 0; i < across.count; ++i) {
      const Texel texel = source(across.first + i, down.first + j);
      const float weight =
          across.weight[static_cast<size_t>(i)] * down.weight[static_cast<size_t>(j)];
      for (size_t channel = 0; channel < 3; ++channel) {
        plain[channel] += weight * texel[channel];
        weighted[channel] += weight * texel[3] * texel[channel];
      }
      plain[3] += weight * texel[3];
    }
  }
  if (alpha_weighted && plain[3] > 0) {
    for (size_t channel = 0; channel < 3; ++channel) plain[channel] = weighted[channel] / plain[3];
  }
  for (float& channel : plain)
    channel = std::min(channel, 1.0f);  // weights sum to 1 but for rounding
  return plain;
}

/// Fills `target` and its words from `source(x, y)`.
template <class Source>
void Reduce(const Codec& codec, Size from, Size to, bool alpha_weighted, const Source& source,
            Level& target, uint32_t* words) {
  const std::vector<Taps> across = MakeTaps(from.width, to.width);
  const std::vector<Taps> down = MakeTaps(from.height, to.height);
  target.resize(static_cast<size_t>(to.width) * static_cast<size_t>(to.height));
  tbb::parallel_for(tbb::blocked_range<size_t>(0, down.size(), 16), [&](const auto& rows) {
    for (size_t y = rows.begin(); y != rows.end(); ++y) {
      for (size_t x = 0; x < across.size(); ++x) {
        const size_t index = y * across.size() + x;
        target[index] = Average(across[x], down[y], alpha_weighted, source);
        codec.Write(target[index], words + index * codec.WordsPerTexel());
      }
    }
  });
}

}  // namespace

int MipLevels(int width, int height) {
  const auto largest = static_cast<uint32_t>(std::max(width, height));
  return std::min(static_cast<int>(std::bit_width(largest)), stages::kMaxMips);
}

int64_t LevelWords(const Texture& texture, int level) {
  const Size size = SizeOf(texture, level);
  return int64_t{size.width} * size.height * (texture.format == TexelFormat::rgba16 ? 2 : 1);
}

void FillMipLevels(const Texture& texture, bool alpha_weighted, std::span<uint32_t> words) {
  const Codec codec(texture);
  alpha_weighted = alpha_weighted && texture.srgb != 0;  // data channels are independent
  Level above, below;
  for (int level = 1; level < texture.levels; ++level) {
    const Size from = SizeOf(texture, level - 1), to = SizeOf(texture, level);
    uint32_t* const out = words.data() + texture.level_offset[level];
    const auto row = static_cast<size_t>(from.width);
    if (level == 1) {
      const uint32_t* const top = words.data() + texture.level_offset[0];
      Reduce(
          codec, from, to, alpha_weighted,
          [&](int x, int y) {
            const size_t index = static_cast<size_t>(y) * row + static_cast<size_t>(x);
            return codec.Read(top + index * codec.WordsPerTexel());
          },
          below, out);
    } else {
      Reduce(
          codec, from, to, alpha_weighted,
          [&](int x, int y) {
            return above[static_cast<size_t>(y) * row + static_cast<size_t>(x)];
          },
          below, out);
    }
    std::swap(above, below);
  }
}

}  // namespace carpool::render
