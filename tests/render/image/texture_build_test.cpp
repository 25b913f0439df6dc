// BuildTextures: layout, sharing, errors.
#include "render/image/texture_build.h"

#include <gtest/gtest.h>

#include <array>
#include <set>

#include "tests/render/image/make_images.h"

namespace carpool::render {
namespace {

using stages::TexelFormat;
using stages::Texture;
using stages::TextureTables;

const std::array<uint32_t, 6> kTexels = {0xff000001u, 0xff000002u, 0xff000003u,
                                         0xff000004u, 0xff000005u, 0xff000006u};

TEST(BuildTextures, LaysOutAllChainsWithoutOverlap) {
  const Bytes rgba8 = MakeRgbaPng(3, 2, kTexels);
  const Bytes rgba16 =
      MakePng({1, 1, 16, 2, false, {}, {}, -1, {0x12, 0x34, 0x56, 0x78, 0x9a, 0xbc}});
  const std::array<EncodedImageView, 2> images = {{{rgba8, "a.png"}, {rgba16, "b.png"}}};
  const std::array<TextureSourceView, 3> sources = {{{1, false}, {0, true}, {0, false}}};
  TextureTables tables;
  tables.slots.resize(5);
  BuildTextures(images, sources, tables, {});

  ASSERT_EQ(tables.textures.size(), 3u);
  EXPECT_EQ(tables.slots.size(), 5u);
  EXPECT_EQ(tables.textures[0].format, TexelFormat::rgba16);
  EXPECT_EQ(tables.words[static_cast<size_t>(tables.textures[0].level_offset[0])], 0x56781234u);
  for (const size_t i : {1u, 2u}) {
    const Texture& texture = tables.textures[i];
    EXPECT_EQ(texture.width, 3);
    EXPECT_EQ(texture.height, 2);
    EXPECT_EQ(texture.levels, 2);
    EXPECT_EQ(texture.srgb, i == 1 ? 1 : 0);
    for (size_t texel = 0; texel < 6; ++texel) {
      EXPECT_EQ(tables.words[static_cast<size_t>(texture.level_offset[0]) + texel], kTexels[texel]);
    }
  }
  EXPECT_EQ(tables.words.size(), 2u + 7u + 7u);
  std::set<int> offsets;
  for (const Texture& texture : tables.textures) {
    for (int level = 0; level < texture.levels; ++level)
      offsets.insert(texture.level_offset[level]);
  }
  EXPECT_EQ(offsets.size(), 5u);
}

// The pool is not cleared before it is filled.
TEST(BuildTextures, FillsEveryWord) {
  const Bytes rgba8 = MakeRgbaPng(3, 2, kTexels);
  const Bytes rgba16 =
      MakePng({1, 1, 16, 2, false, {}, {}, -1, {0x12, 0x34, 0x56, 0x78, 0x9a, 0xbc}});
  const std::array<EncodedImageView, 2> images = {{{rgba8, "a.png"}, {rgba16, "b.png"}}};
  const std::array<TextureSourceView, 3> sources = {{{1, false}, {0, true}, {0, false}}};
  const auto build = [&](uint32_t before) {
    TextureTables tables;
    tables.words.assign(1000, before);
    BuildTextures(images, sources, tables, {});
    return tables.words;
  };
  EXPECT_EQ(build(0), build(0xdeadbeefu));
}

TEST(BuildTextures, EqualSourcesShareTheirTexels) {
  const Bytes png = MakeRgbaPng(3, 2, kTexels);
  const std::array<EncodedImageView, 1> images = {{{png, "a.png"}}};
  const std::array<TextureSourceView, 3> sources = {{{0, true}, {0, true}, {0, true, false}}};
  TextureTables tables;
  BuildTextures(images, sources, tables, {});
  EXPECT_EQ(tables.textures[0].level_offset[0], tables.textures[1].level_offset[0]);
  EXPECT_NE(tables.textures[0].level_offset[0], tables.textures[2].level_offset[0]);
}

TEST(BuildTextures, UnusedImagesAreNotLookedAt) {
  const Bytes broken = ToBytes("not an image");
  const std::array<EncodedImageView, 1> images = {{{broken, "a.png"}}};
  TextureTables tables;
  BuildTextures(images, {}, tables, {});
  EXPECT_TRUE(tables.textures.empty());
  EXPECT_TRUE(tables.words.empty());
}

TEST(BuildTextures, ReportsTheFirstBadImageWhateverTheThreadsDo) {
  const Bytes good = MakeRgbaPng(3, 2, kTexels);
  Bytes bad = good;
  bad[bad.size() - 20] ^= std::byte{0x10};
  std::vector<EncodedImageView> images;
  std::vector<TextureSourceView> sources;
  for (int i = 0; i < 40; ++i) {
    images.push_back({i % 10 == 7 ? bad : good, "image" + std::to_string(i)});
    sources.push_back({39 - i, true});
  }
  for (int run = 0; run < 20; ++run) {
    TextureTables tables;
    try {
      BuildTextures(images, sources, tables, {});
      FAIL() << "no error";
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).rfind("image7: ", 0), 0u) << error.what();
      EXPECT_EQ(error.code(), ExitCode::bad_input);
    }
  }
}

TEST(BuildTextures, MoreThanThePoolHoldsIsRefusedBeforeAllocating) {
  // 16000 x 16000 in 1 bit: a small file, but 256 M texels; ten of them exceed 2^31 - 1 words.
  const Bytes png =
      MakePng({16000, 16000, 1, 0, false, {}, {}, -1, std::vector<uint8_t>(2000 * 16000)});
  const std::vector<EncodedImageView> images(10, {png, "big.png"});
  std::vector<TextureSourceView> sources;
  for (int i = 0; i < 10; ++i) sources.push_back({i, true});
  TextureTables tables;
  try {
    BuildTextures(images, sources, tables, {});
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("8 GiB"), std::string::npos);
  }
}

}  // namespace
}  // namespace carpool::render
