// See mip_filter.h.
#include "render/image/mip_filter.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <vector>

#include "render/image/srgb_encode.h"

namespace carpool::render {
namespace {

using stages::TexelFormat;
using stages::Texture;

using Texel = std::array<float, 4>;  // straight colour in linear light, and alpha

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

/// What each byte is as a share of the largest: a look-up costs less than a division.
constexpr std::array<float, 256> kByteShares = [] {
  std::array<float, 256> shares{};
  for (size_t code = 0; code < shares.size(); ++code) shares[code] = static_cast<float>(code) / 255;
  return shares;
}();

/// Texels of one kind of texture between words and linear light. The kind is a template's matter
/// because all of this is done for each texel of a scene while somebody waits.
template <TexelFormat kFormat, bool kSrgb>
class Codec {
 public:
  static constexpr size_t kWords = kFormat == TexelFormat::rgba16 ? 2 : 1;

  Texel Read(const uint32_t* word) const {
    Texel texel;
    for (size_t channel = 0; channel < 4; ++channel) {
      const uint32_t code = kWords == 2 ? word[channel / 2] >> (16 * (channel % 2)) & 0xffff
                                        : word[0] >> (8 * channel) & 0xff;
      texel[channel] = kSrgb && channel < 3 ? table_[code] : Share(code);
    }
    return texel;
  }

  void Write(const Texel& texel, uint32_t* word) const {
    std::array<uint32_t, 4> code;
    for (size_t channel = 0; channel < 4; ++channel) {
      code[channel] = kSrgb && channel < 3 ? EncodeColor(texel[channel]) : Round(texel[channel]);
    }
    if constexpr (kWords == 2) {
      word[0] = code[0] | code[1] << 16;
      word[1] = code[2] | code[3] << 16;
    } else {
      word[0] = code[0] | code[1] << 8 | code[2] << 16 | code[3] << 24;
    }
  }

 private:
  static constexpr double kMost = kWords == 2 ? 65535 : 255;

  static const float* Table() {
    return kWords == 2 ? stages::SrgbDecode16().data() : stages::SrgbDecode8().data();
  }
  static float Share(uint32_t code) {
    if constexpr (kWords == 2) return static_cast<float>(code) / 65535;
    return kByteShares[code];
  }
  static uint32_t Round(double share) {
    return static_cast<uint32_t>(static_cast<int32_t>(share * kMost + 0.5));
  }
  uint32_t EncodeColor(float linear) const {
    if constexpr (kWords == 1) return encoder_(linear);
    return Round(stages::LinearToSrgb(linear));
  }

  const float* table_ = kSrgb ? Table() : nullptr;
  const Srgb8Encoder& encoder_ = Srgb8Encoder::Instance();
};

/// Averages the source texels under two taps; `source(x, y)` gives one. With kWeighted, colours
/// count by their alpha; with kPairs, there are two by two.
template <bool kWeighted, bool kPairs, class Source>
Texel Average(const Taps& across, const Taps& down, const Source& source) {
  Texel plain{}, weighted{};
  for (int j = 0; j < (kPairs ? 2 : down.count); ++j) {
    for (int i = 0; i < (kPairs ? 2 : across.count); ++i) {
      const Texel texel = source(across.first + i, down.first + j);
      const float weight =
          across.weight[static_cast<size_t>(i)] * down.weight[static_cast<size_t>(j)];
      for (size_t channel = 0; channel < 4; ++channel) plain[channel] += weight * texel[channel];
      if constexpr (kWeighted) {
        for (size_t channel = 0; channel < 3; ++channel)
          weighted[channel] += weight * texel[3] * texel[channel];
      }
    }
  }
  if (kWeighted && plain[3] > 0) {
    for (size_t channel = 0; channel < 3; ++channel) plain[channel] = weighted[channel] / plain[3];
  }
  for (float& channel : plain)
    channel = std::min(channel, 1.0f);  // weights sum to 1 but for rounding
  return plain;
}

/// Fills `target` and its words from `source(x, y)`.
template <bool kWeighted, bool kPairs, class Codec, class Source>
void Reduce(const Codec& codec, const std::vector<Taps>& across, const std::vector<Taps>& down,
            const Source& source, Texel* target, uint32_t* words) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, down.size(), 16), [&](const auto& rows) {
    for (size_t y = rows.begin(); y != rows.end(); ++y) {
      for (size_t x = 0; x < across.size(); ++x) {
        const size_t index = y * across.size() + x;
        const Texel texel = Average<kWeighted, kPairs>(across[x], down[y], source);
        target[index] = texel;
        codec.Write(texel, words + index * Codec::kWords);
      }
    }
  });
}

template <bool kWeighted, class Codec, class Source>
void Reduce(const Codec& codec, Size from, Size to, const Source& source, Texel* target,
            uint32_t* words) {
  const std::vector<Taps> across = MakeTaps(from.width, to.width);
  const std::vector<Taps> down = MakeTaps(from.height, to.height);
  if (across[0].count == 2 && down[0].count == 2) {
    Reduce<kWeighted, true>(codec, across, down, source, target, words);
  } else {
    Reduce<kWeighted, false>(codec, across, down, source, target, words);
  }
}

/// Room for a level; what it holds is not set.
std::unique_ptr<Texel[]> MakeLevel(const Texture& texture, int level) {
  const Size size = SizeOf(texture, level);
  return std::make_unique_for_overwrite<Texel[]>(static_cast<size_t>(size.width) *
                                                 static_cast<size_t>(size.height));
}

template <bool kWeighted, class Codec>
void FillLevels(const Codec& codec, const Texture& texture, std::span<uint32_t> words) {
  std::unique_ptr<Texel[]> above, below;
  for (int level = 1; level < texture.levels; ++level) {
    const Size from = SizeOf(texture, level - 1), to = SizeOf(texture, level);
    uint32_t* const out = words.data() + texture.level_offset[level];
    const auto row = static_cast<size_t>(from.width);
    const auto index = [&](int x, int y) {
      return static_cast<size_t>(y) * row + static_cast<size_t>(x);
    };
    if (level <= 2) below = MakeLevel(texture, level);  // later ones fit into these two
    if (level == 1) {
      const uint32_t* const top = words.data() + texture.level_offset[0];
      const auto source = [&](int x, int y) {
        return codec.Read(top + index(x, y) * Codec::kWords);
      };
      Reduce<kWeighted>(codec, from, to, source, below.get(), out);
    } else {
      const auto source = [&](int x, int y) { return above[index(x, y)]; };
      Reduce<kWeighted>(codec, from, to, source, below.get(), out);
    }
    std::swap(above, below);
  }
}

template <TexelFormat kFormat>
void FillFormat(const Texture& texture, bool alpha_weighted, std::span<uint32_t> words) {
  if (texture.srgb == 0) {  // data channels are independent
    FillLevels<false>(Codec<kFormat, false>(), texture, words);
  } else if (alpha_weighted) {
    FillLevels<true>(Codec<kFormat, true>(), texture, words);
  } else {
    FillLevels<false>(Codec<kFormat, true>(), texture, words);
  }
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
  if (texture.format == TexelFormat::rgba16) {
    FillFormat<TexelFormat::rgba16>(texture, alpha_weighted, words);
  } else {
    FillFormat<TexelFormat::rgba8>(texture, alpha_weighted, words);
  }
}

}  // namespace carpool::render
