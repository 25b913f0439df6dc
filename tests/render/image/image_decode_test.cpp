// PNG and JPEG decoding: every colour type and depth, limits, and broken files.
#include "render/image/image_decode.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "tests/render/image/make_images.h"

namespace carpool::render {
namespace {

using stages::TexelFormat;

struct Decoded {
  ImageInfo info;
  std::vector<uint32_t> words;
};

Decoded Decode(const Bytes& bytes, const WarningSink& warn = {}) {
  Decoded out;
  out.info = ReadImageInfo(bytes, "file.img");
  out.words.resize(static_cast<size_t>(out.info.Words()));
  DecodeImage(bytes, "file.img", out.info, out.words, warn);
  return out;
}

/// The message of the InputError that decoding gives, or "" if it gives none.
std::string ErrorOf(const Bytes& bytes) {
  try {
    Decode(bytes);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

Bytes FirstBytes(const Bytes& bytes, size_t count) {
  return Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count));
}

TEST(PngDecode, GreyOfEveryDepthBecomesRgb) {
  struct Case {
    int depth;
    std::vector<uint8_t> row;  // two pixels: 0 and the largest
  };
  for (const Case& c : {Case{1, {0x40}}, Case{2, {0x30}}, Case{4, {0x0f}}, Case{8, {0x00, 0xff}}}) {
    const Decoded out = Decode(MakePng({2, 1, c.depth, 0, false, {}, {}, -1, c.row}));
    EXPECT_EQ(out.info.format, TexelFormat::rgba8) << c.depth;
    EXPECT_EQ(out.words, (std::vector<uint32_t>{0xff000000u, 0xffffffffu})) << c.depth;
  }
}

TEST(PngDecode, SixteenBitsAreKept) {
  const Decoded out =
      Decode(MakePng({1, 1, 16, 2, false, {}, {}, -1, {0x12, 0x34, 0x56, 0x78, 0x9a, 0xbc}}));
  EXPECT_EQ(out.info.format, TexelFormat::rgba16);
  EXPECT_EQ(out.words, (std::vector<uint32_t>{0x56781234u, 0xffff9abcu}));
  const Decoded grey = Decode(MakePng({1, 1, 16, 4, false, {}, {}, -1, {0x12, 0x34, 0x80, 0x01}}));
  EXPECT_EQ(grey.words, (std::vector<uint32_t>{0x12341234u, 0x80011234u}));
}

TEST(PngDecode, PaletteWithTransparency) {
  const PngRecipe recipe{2,        2,  8,           3, false, {1, 2, 3, 4, 5, 6, 7, 8, 9},
                         {0, 128}, -1, {0, 1, 2, 0}};
  EXPECT_EQ(Decode(MakePng(recipe)).words,
            (std::vector<uint32_t>{0x00030201u, 0x80060504u, 0xff090807u, 0x00030201u}));
}

TEST(PngDecode, TransparentGreyBecomesAlpha) {
  EXPECT_EQ(Decode(MakePng({2, 1, 8, 0, false, {}, {}, 7, {7, 9}})).words,
            (std::vector<uint32_t>{0x00070707u, 0xff090909u}));
}

TEST(PngDecode, InterlacedEqualsPlain) {
  PngRecipe recipe{5, 3, 8, 6};
  for (uint8_t i = 0; i < 5 * 3 * 4; ++i) recipe.rows.push_back(static_cast<uint8_t>(i * 4));
  const Decoded plain = Decode(MakePng(recipe));
  recipe.interlaced = true;
  EXPECT_EQ(Decode(MakePng(recipe)).words, plain.words);
  EXPECT_EQ(plain.words[0], 0x0c080400u);
}

TEST(PngDecode, EveryTruncationIsAnInputError) {
  const Bytes png = MakeRgbaPng(3, 2, std::array<uint32_t, 6>{1, 2, 3, 4, 5, 6});
  ASSERT_EQ(ErrorOf(png), "");
  for (size_t count = 0; count < png.size(); ++count) {
    EXPECT_NE(ErrorOf(FirstBytes(png, count)).find("file.img: "), std::string::npos) << count;
  }
}

TEST(PngDecode, CorruptDataIsAnInputError) {
  Bytes png = MakeRgbaPng(3, 2, std::array<uint32_t, 6>{1, 2, 3, 4, 5, 6});
  png[png.size() - 20] ^= std::byte{0x10};  // inside IDAT
  EXPECT_NE(ErrorOf(png).find("file.img: bad PNG: "), std::string::npos);
}

/// Bytes of a PNG that ends after a header with the given size.
Bytes PngHeaderOnly(uint32_t width, uint32_t height) {
  Bytes png = MakeRgbaPng(1, 1, std::array<uint32_t, 1>{0});
  for (int i = 0; i < 4; ++i) {
    png[16 + static_cast<size_t>(i)] = static_cast<std::byte>(width >> (24 - 8 * i));
    png[20 + static_cast<size_t>(i)] = static_cast<std::byte>(height >> (24 - 8 * i));
  }
  uint32_t crc = ~0u;  // of IHDR and its data
  for (size_t i = 12; i < 29; ++i) {
    crc ^= static_cast<uint32_t>(png[i]);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
  }
  for (int i = 0; i < 4; ++i)
    png[29 + static_cast<size_t>(i)] = static_cast<std::byte>(~crc >> (24 - 8 * i));
  return png;
}

TEST(PngDecode, HugeClaimsAreRefusedFromTheHeader) {
  EXPECT_EQ(ErrorOf(PngHeaderOnly(1, 1)), "");
  EXPECT_NE(ErrorOf(PngHeaderOnly(16384, 16384)).find("claims more pixels"), std::string::npos);
  EXPECT_NE(ErrorOf(PngHeaderOnly(40000, 40000)).find("pixels; at most"), std::string::npos);
  EXPECT_NE(ErrorOf(PngHeaderOnly(1 << 20, 1)).find("file.img: bad PNG"), std::string::npos);
}

TEST(JpegDecode, ColourGreyAndCmyk) {
  const auto expect = [](const Bytes& jpeg, std::array<int, 3> rgb) {
    const Decoded out = Decode(jpeg);
    EXPECT_EQ(out.info.format, TexelFormat::rgba8);
    ASSERT_EQ(out.words.size(), 17u * 9u);
    for (const uint32_t word : out.words) {
      for (int channel = 0; channel < 3; ++channel) {
        ASSERT_NEAR(static_cast<int>(word >> (8 * channel) & 0xff),
                    rgb[static_cast<size_t>(channel)], 2);
      }
      ASSERT_EQ(word >> 24, 255u);
    }
  };
  expect(MakeJpeg(17, 9, JpegKind::rgb, std::array<uint8_t, 3>{200, 100, 50}), {200, 100, 50});
  expect(MakeJpeg(17, 9, JpegKind::grey, std::array<uint8_t, 1>{77}), {77, 77, 77});
  // Inverted CMYK: R = C x K / 255.
  expect(MakeJpeg(17, 9, JpegKind::cmyk, std::array<uint8_t, 4>{255, 128, 0, 128}), {128, 64, 0});
}

TEST(JpegDecode, EveryTruncationIsAnInputError) {
  const Bytes jpeg = MakeJpeg(17, 9, JpegKind::rgb, std::array<uint8_t, 3>{200, 100, 50});
  for (size_t count = 0; count + 2 < jpeg.size(); ++count) {
    EXPECT_NE(ErrorOf(FirstBytes(jpeg, count)).find("file.img: "), std::string::npos) << count;
  }
}

TEST(JpegDecode, HarmlessOdditiesAreWarnedOf) {
  Bytes jpeg = MakeJpeg(17, 9, JpegKind::rgb, std::array<uint8_t, 3>{200, 100, 50});
  const std::array table = {std::byte{0xff}, std::byte{0xdb}};  // before the first marker of tables
  const auto at = std::search(jpeg.begin(), jpeg.end(), table.begin(), table.end());
  ASSERT_NE(at, jpeg.end());
  jpeg.insert(at, std::byte{1});
  std::string warning;
  EXPECT_EQ(Decode(jpeg, [&](const std::string& line) { warning = line; }).words.size(), 17u * 9u);
  EXPECT_NE(warning.find("file.img: "), std::string::npos);
}

TEST(JpegDecode, HugeClaimsAreRefusedFromTheHeader) {
  Bytes jpeg = MakeJpeg(17, 9, JpegKind::rgb, std::array<uint8_t, 3>{200, 100, 50});
  for (size_t i = 0; i + 8 < jpeg.size(); ++i) {
    if (jpeg[i] == std::byte{0xff} && jpeg[i + 1] == std::byte{0xc0}) {  // start of frame
      jpeg[i + 5] = jpeg[i + 7] = std::byte{0x3f};                       // about 16000 x 16000
      break;
    }
  }
  EXPECT_NE(ErrorOf(jpeg).find("claims more pixels"), std::string::npos);
}

TEST(ImageDecode, OtherFormatsAreNamed) {
  EXPECT_NE(ErrorOf(ToBytes("GIF89a.........")).find("GIF"), std::string::npos);
  EXPECT_NE(ErrorOf(ToBytes("RIFF....WEBPVP8 ")).find("WebP"), std::string::npos);
  EXPECT_NE(ErrorOf(ToBytes("hello")).find("unknown format"), std::string::npos);
  EXPECT_NE(ErrorOf({}).find("empty"), std::string::npos);
}

}  // namespace
}  // namespace carpool::render
