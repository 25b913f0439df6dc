// Mip chains: closed forms, odd sizes, linear light, alpha weights.
#include "render/image/mip_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "stages/tables/srgb.h"

namespace carpool::render {
namespace {

using stages::TexelFormat;
using stages::Texture;

struct Chain {
  Texture texture;
  std::vector<uint32_t> words;

  uint32_t Word(int level, int index) const {
    return words[static_cast<size_t>(texture.level_offset[level] + index)];
  }
};

Chain MakeChain(int width, int height, TexelFormat format, bool srgb, bool alpha_weighted,
                const std::vector<uint32_t>& level0) {
  Chain chain;
  Texture& texture = chain.texture;
  texture.width = width;
  texture.height = height;
  texture.format = format;
  texture.srgb = srgb ? 1 : 0;
  texture.levels = MipLevels(width, height);
  int64_t words = 0;
  for (int level = 0; level < texture.levels; ++level) {
    texture.level_offset[level] = static_cast<int32_t>(words);
    words += LevelWords(texture, level);
  }
  chain.words = level0;
  chain.words.resize(static_cast<size_t>(words), 0xdeadbeefu);
  FillMipLevels(texture, alpha_weighted, chain.words);
  return chain;
}

TEST(MipFilter, LevelCounts) {
  EXPECT_EQ(MipLevels(1, 1), 1);
  EXPECT_EQ(MipLevels(2, 1), 2);
  EXPECT_EQ(MipLevels(7, 5), 3);
  EXPECT_EQ(MipLevels(4096, 16), 13);
  EXPECT_EQ(MipLevels(65536, 1), stages::kMaxMips);
}

TEST(MipFilter, ConstantImagesStayConstantInEverySizeAndFormat) {
  for (const TexelFormat format : {TexelFormat::rgba8, TexelFormat::rgba16}) {
    for (const bool srgb : {false, true}) {
      for (const auto& [width, height] : {std::pair{16, 16}, {15, 9}, {1, 13}, {33, 2}, {5, 1}}) {
        const int words = width * height * (format == TexelFormat::rgba16 ? 2 : 1);
        const Chain chain =
            MakeChain(width, height, format, srgb, true,
                      std::vector<uint32_t>(static_cast<size_t>(words), 0x51515151u));
        for (const uint32_t word : chain.words)
          ASSERT_EQ(word, 0x51515151u) << width << " " << srgb;
      }
    }
  }
}

TEST(MipFilter, SrgbIsAveragedInLinearLight) {
  const uint32_t black = 0xff000000u, white = 0xffffffffu;
  const Chain srgb = MakeChain(2, 1, TexelFormat::rgba8, true, true, {black, white});
  EXPECT_EQ(srgb.Word(1, 0), 0xffbcbcbcu);  // 188 encodes one half
  const Chain linear = MakeChain(2, 1, TexelFormat::rgba8, false, true, {black, white});
  EXPECT_EQ(linear.Word(1, 0), 0xff808080u);
}

TEST(MipFilter, ColoursCountByTheirAlpha) {
  const uint32_t opaque_red = 0xff0000ffu, clear_green = 0x0000ff00u;
  const std::vector<uint32_t> level0 = {opaque_red, clear_green};
  EXPECT_EQ(MakeChain(2, 1, TexelFormat::rgba8, true, true, level0).Word(1, 0), 0x800000ffu);
  EXPECT_EQ(MakeChain(2, 1, TexelFormat::rgba8, true, false, level0).Word(1, 0), 0x8000bcbcu);
  // Nothing is opaque: the plain mean.
  EXPECT_EQ(MakeChain(2, 1, TexelFormat::rgba8, true, true, {0x000000ffu, 0x0000ff00u}).Word(1, 0),
            0x0000bcbcu);
}

TEST(MipFilter, OddSizesWeighByCoverage) {
  // 3 -> 1: a third each. 5 -> 2: (2, 2, 1) / 5 and (1, 2, 2) / 5.
  const auto grey = [](uint32_t v) { return 0xff000000u | v | v << 8 | v << 16; };
  EXPECT_EQ(
      MakeChain(3, 1, TexelFormat::rgba8, false, true, {grey(0), grey(30), grey(90)}).Word(1, 0),
      grey(40));
  const Chain five = MakeChain(1, 5, TexelFormat::rgba8, false, true,
                               {grey(0), grey(50), grey(100), grey(150), grey(200)});
  EXPECT_EQ(five.Word(1, 0), grey(40));
  EXPECT_EQ(five.Word(1, 1), grey(160));
  EXPECT_EQ(five.Word(2, 0), grey(100));
}

TEST(MipFilter, TheLastLevelIsTheMeanOfTheImage) {
  std::mt19937 random(1);
  for (const auto& [width, height] : {std::pair{64, 64}, {63, 17}, {31, 100}, {1, 77}}) {
    std::vector<uint32_t> level0;
    std::array<double, 4> mean{};
    for (int i = 0; i < width * height; ++i) {
      level0.push_back(static_cast<uint32_t>(random()));
      for (size_t channel = 0; channel < 4; ++channel) {
        mean[channel] += (level0.back() >> (8 * channel) & 0xff) / double(width * height);
      }
    }
    const Chain chain = MakeChain(width, height, TexelFormat::rgba8, false, true, level0);
    const uint32_t last = chain.Word(chain.texture.levels - 1, 0);
    for (size_t channel = 0; channel < 4; ++channel) {
      EXPECT_NEAR(last >> (8 * channel) & 0xff, mean[channel], 0.51) << width << " " << height;
    }
  }
}

TEST(MipFilter, SixteenBitsKeepTheirPrecision) {
  // Two texels 0x1000 and 0x1001 in linear data: the mean rounds to one of them, not to an 8-bit
  // step.
  const Chain chain = MakeChain(2, 1, TexelFormat::rgba16, false, true,
                                {0x10001000u, 0xffff1000u, 0x10031003u, 0xffff1003u});
  EXPECT_NEAR(chain.Word(1, 0) & 0xffff, 0x1001, 1);
  const Chain srgb =
      MakeChain(2, 1, TexelFormat::rgba16, true, true, {0, 0xffff0000u, 0xffffffffu, 0xffffffffu});
  EXPECT_EQ(srgb.Word(1, 0) & 0xffff,
            static_cast<uint32_t>(std::lround(65535 * stages::LinearToSrgb(0.5))));
}

}  // namespace
}  // namespace carpool::render
