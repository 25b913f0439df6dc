// Environment maps: Radiance in all its encodings and orientations, EXR variants, the texel policy.
#include "render/image/environment_read.h"

#include <gtest/gtest.h>

#include <half.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfTiledOutputFile.h>

#include <cmath>
#include <limits>

#include "render/image/primaries.h"
#include "tests/render/image/make_images.h"

namespace carpool::render {
namespace {

using Floats = std::vector<float>;

struct Result {
  EnvironmentMap map;
  std::string warnings;
  std::string error;
};

Result Read(std::span<const std::byte> bytes) {
  Result result;
  try {
    result.map = DecodeEnvironment(
        bytes, "env", [&](const std::string& line) { result.warnings += line + "\n"; });
  } catch (const InputError& error) {
    result.error = error.what();
  }
  return result;
}

/// A Radiance file of `pixels` behind a header with extra lines.
Bytes Hdr(const std::string& resolution, const std::string& pixels, const std::string& lines = "") {
  return ToBytes("#?RADIANCE\n" + lines + "FORMAT=32-bit_rle_rgbe\n\n" + resolution + "\n" +
                 pixels);
}

// RGBE: (128, 64, 32, 129) is (1, 0.5, 0.25).
const std::string kOne = "\x80\x40\x20\x81";

TEST(Radiance, FlatPixels) {
  const Result out = Read(Hdr("-Y 1 +X 2", kOne + std::string("\xff\x01\x00\x00", 4)));
  EXPECT_EQ(out.error, "");
  EXPECT_EQ(out.map.width, 2);
  EXPECT_EQ(out.map.height, 1);
  EXPECT_EQ(out.map.rgb, (Floats{1, 0.5f, 0.25f, 0, 0, 0}));  // exponent 0 is black
  EXPECT_EQ(out.warnings, "");
}

TEST(Radiance, OldRunsRepeatThePixelBeforeWithDigitsInBase256) {
  const Result out =
      Read(Hdr("-Y 1 +X 262", kOne + "\x01\x01\x01\x04" + "\x01\x01\x01\x01" + kOne));
  EXPECT_EQ(out.error, "");
  ASSERT_EQ(out.map.rgb.size(), 3u * 262u);  // 1 + 4 + 1 x 256 + 1
  for (size_t i = 0; i < out.map.rgb.size(); i += 3) ASSERT_EQ(out.map.rgb[i + 1], 0.5f) << i;
}

TEST(Radiance, NewRunsPerChannel) {
  const std::string line = std::string("\x02\x02\x00\x08", 4) + "\x88\x80" +  // red: run of 8
                           "\x04\x40\x40\x40\x40\x84\x40" +                   // green: 4 plain, run
                           "\x88\x20" + "\x87\x81" + "\x01\x82";              // exponents
  const Result out = Read(Hdr("-Y 1 +X 8", line));
  EXPECT_EQ(out.error, "");
  for (size_t x = 0; x < 8; ++x) {
    const float scale = x == 7 ? 2 : 1;
    EXPECT_EQ(out.map.rgb[3 * x], scale);
    EXPECT_EQ(out.map.rgb[3 * x + 1], scale / 2);
    EXPECT_EQ(out.map.rgb[3 * x + 2], scale / 4);
  }
}

TEST(Radiance, ExposureIsDividedOut) {
  const Result out = Read(Hdr("-Y 1 +X 1", kOne, "EXPOSURE=2\nEXPOSURE= 4.0\n"));
  EXPECT_EQ(out.map.rgb, (Floats{1.0f / 8, 0.5f / 8, 0.25f / 8}));
}

TEST(Radiance, SenselessPrimariesAreIgnoredWithAWarning) {
  const Result out = Read(Hdr("-Y 1 +X 1", kOne, "PRIMARIES=.3 .3 .3 .3 .3 .3 .3 .3\n"));
  EXPECT_EQ(out.map.rgb, (Floats{1, 0.5f, 0.25f}));
  EXPECT_NE(out.warnings.find("Rec.709 is assumed"), std::string::npos);
  // Zeros are how some programs write "unknown".
  const Result zeros = Read(Hdr("-Y 1 +X 1", kOne, "PRIMARIES=0 0 0 0 0 0 0 0\n"));
  EXPECT_EQ(zeros.map.rgb, (Floats{1, 0.5f, 0.25f}));
  EXPECT_EQ(zeros.warnings, "");
}

/// Red of each texel of a 3 x 2 picture whose file order is 1, 2, 3, 4, 5, 6.
Floats RedsIn(const std::string& resolution) {
  std::string pixels;
  for (char i = 1; i <= 6; ++i) pixels += {i, 0, 0, char(136)};
  const Result out = Read(Hdr(resolution, pixels));
  EXPECT_EQ(out.error, "");
  EXPECT_EQ(out.map.width, 3);
  EXPECT_EQ(out.map.height, 2);
  Floats reds;
  for (size_t i = 0; i < out.map.rgb.size(); i += 3) reds.push_back(out.map.rgb[i]);
  return reds;
}

TEST(Radiance, AllEightOrientations) {
  EXPECT_EQ(RedsIn("-Y 2 +X 3"), (Floats{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(RedsIn("+Y 2 +X 3"), (Floats{4, 5, 6, 1, 2, 3}));
  EXPECT_EQ(RedsIn("-Y 2 -X 3"), (Floats{3, 2, 1, 6, 5, 4}));
  EXPECT_EQ(RedsIn("+Y 2 -X 3"), (Floats{6, 5, 4, 3, 2, 1}));
  EXPECT_EQ(RedsIn("+X 3 -Y 2"), (Floats{1, 3, 5, 2, 4, 6}));
  EXPECT_EQ(RedsIn("+X 3 +Y 2"), (Floats{2, 4, 6, 1, 3, 5}));
  EXPECT_EQ(RedsIn("-X 3 -Y 2"), (Floats{5, 3, 1, 6, 4, 2}));
  EXPECT_EQ(RedsIn("-X 3 +Y 2"), (Floats{6, 4, 2, 5, 3, 1}));
}

TEST(Radiance, BadFilesAreNamed) {
  const auto error = [](const Bytes& bytes) { return Read(bytes).error; };
  EXPECT_NE(error(Hdr("-Y 1 +X 2", kOne)).find("ends too early"), std::string::npos);
  EXPECT_NE(error(Hdr("-Y 1 +X 2", kOne + "\x01\x01\x01\x05")).find("run leaves"),
            std::string::npos);
  EXPECT_NE(error(Hdr("-Y 1 +X 2", "\x01\x01\x01\x02")).find("run leaves"), std::string::npos);
  EXPECT_NE(error(Hdr("-Y 1 +X 8", std::string("\x02\x02\x00\x08\x89\x80", 6))).find("run leaves"),
            std::string::npos);
  EXPECT_NE(error(Hdr("-Y 1 +X 9", std::string("\x02\x02\x00\x08", 4))).find("wrong length"),
            std::string::npos);
  EXPECT_NE(error(Hdr("-Y 0 +X 9", "")).find("no pixels"), std::string::npos);
  EXPECT_NE(error(Hdr("-Y -5 +X -5", "")).find("no pixels"), std::string::npos);
  EXPECT_NE(error(Hdr("-Y 60000 +X 60000", "")).find("at most"), std::string::npos);
  EXPECT_NE(error(Hdr("-Y 16384 +X 16384", "")).find("more than"), std::string::npos);
  EXPECT_NE(error(Hdr("-Y 2 +Y 2", "")).find("resolution"), std::string::npos);
  EXPECT_NE(error(Hdr("hello", "")).find("resolution"), std::string::npos);
  EXPECT_NE(error(Hdr("-Y 1 +X 1", kOne, "EXPOSURE=0\n")).find("EXPOSURE"), std::string::npos);
  EXPECT_NE(error(ToBytes("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n")).find("xyze"),
            std::string::npos);
  EXPECT_NE(error(ToBytes("#?RADIANCE\n")).find("ends too early"), std::string::npos);
  EXPECT_NE(error(ToBytes("hello")).find("neither"), std::string::npos);
  EXPECT_NE(error(ToBytes("")).find("neither"), std::string::npos);
}

/// Writes an EXR by OpenEXR itself: channel i of texel t is values[t * channels + i].
class ExrMaker {
 public:
  ExrMaker(std::vector<std::string> channels, Imf::PixelType type, Imath::Box2i window)
      : header_(window, window), channels_(std::move(channels)), type_(type) {
    for (const std::string& name : channels_) header_.channels().insert(name, Imf::Channel(type));
  }
  Imf::Header& Header() { return header_; }

  Bytes Make(const Floats& values) {
    const TemporaryFolder folder;
    const std::string path = (folder / "a.exr").string();
    const Imf::FrameBuffer frame = Frame(values);
    if (header_.hasTileDescription()) {
      Imf::TiledOutputFile file(path.c_str(), header_);
      file.setFrameBuffer(frame);
      for (int level = 0; level < file.numLevels(); ++level) {
        file.writeTiles(0, file.numXTiles(level) - 1, 0, file.numYTiles(level) - 1, level);
      }
    } else {
      Imf::OutputFile file(path.c_str(), header_);
      file.setFrameBuffer(frame);
      const Imath::Box2i window = header_.dataWindow();
      file.writePixels(window.max.y - window.min.y + 1);
    }
    return ReadBytes(path);
  }

 private:
  Imf::FrameBuffer Frame(const Floats& values) {
    const Imath::Box2i window = header_.dataWindow();
    const int width = window.max.x - window.min.x + 1, height = window.max.y - window.min.y + 1;
    Imf::FrameBuffer frame;
    const size_t size = type_ == Imf::HALF ? 2 : 4;
    storage_.assign(values.size() * size, std::byte{});
    for (size_t i = 0; i < values.size(); ++i) {
      if (type_ == Imf::HALF) {
        const half value = values[i];
        std::memcpy(&storage_[i * size], &value, size);
      } else {
        std::memcpy(&storage_[i * size], &values[i], size);
      }
    }
    for (size_t i = 0; i < channels_.size(); ++i) {
      const size_t stride = channels_.size() * size;
      frame.insert(channels_[i],
                   Imf::Slice::Make(type_, &storage_[i * size], window.min, width, height, stride,
                                    stride * static_cast<size_t>(width)));
    }
    return frame;
  }

  Imf::Header header_;
  std::vector<std::string> channels_;
  Imf::PixelType type_;
  std::vector<std::byte> storage_;
};

const Imath::Box2i kTwoByOne({0, 0}, {1, 0});

TEST(ExrEnvironment, HalfAndFloatWithOtherChannelsAround) {
  for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT}) {
    ExrMaker maker({"A", "B", "G", "R", "depth.Z"}, type, kTwoByOne);
    const Result out = Read(maker.Make({1, 0.25f, 0.5f, 65504, 9, 1, 2, 3, 4, 9}));
    EXPECT_EQ(out.error, "");
    EXPECT_EQ(out.map.rgb, (Floats{65504, 0.5f, 0.25f, 4, 3, 2}));
    EXPECT_EQ(out.warnings, "");
  }
}

TEST(ExrEnvironment, GreyFromY) {
  ExrMaker maker({"Y"}, Imf::FLOAT, kTwoByOne);
  EXPECT_EQ(Read(maker.Make({0.5f, 2})).map.rgb, (Floats{0.5f, 0.5f, 0.5f, 2, 2, 2}));
}

TEST(ExrEnvironment, AnyOriginAndEveryCompression) {
  for (const Imf::Compression compression :
       {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION,
        Imf::PIZ_COMPRESSION, Imf::PXR24_COMPRESSION, Imf::B44_COMPRESSION, Imf::B44A_COMPRESSION,
        Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION}) {
    // A constant image is each codec's smallest, and must not be taken for a false claim.
    ExrMaker maker({"R", "G", "B"}, Imf::HALF, Imath::Box2i({-700, 40}, {-700 + 1023, 40 + 511}));
    maker.Header().compression() = compression;
    const Result out = Read(maker.Make(Floats(3 * 1024 * 512, 0.5f)));
    ASSERT_EQ(out.error, "") << compression;
    ASSERT_EQ(out.map.width, 1024);
    for (const float value : out.map.rgb) ASSERT_NEAR(value, 0.5f, 0.01f) << compression;
  }
}

TEST(ExrEnvironment, TilesWithMipLevels) {
  ExrMaker maker({"R", "G", "B"}, Imf::FLOAT, Imath::Box2i({0, 0}, {69, 40}));
  maker.Header().setTileDescription(Imf::TileDescription(16, 16, Imf::MIPMAP_LEVELS));
  Floats values;
  for (size_t i = 0; i < 3 * 70 * 41; ++i) values.push_back(static_cast<float>(i));
  const Result out = Read(maker.Make(values));
  EXPECT_EQ(out.error, "");
  EXPECT_EQ(out.map.rgb, values);
}

TEST(ExrEnvironment, BrokenTexelsBecomeZeroAndAreCounted) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  ExrMaker maker({"R", "G", "B"}, Imf::FLOAT, Imath::Box2i({0, 0}, {3, 0}));
  const Result out = Read(maker.Make({1, std::nanf(""), 1, kInf, 1, 1, 1, -2, 3, 4, 5, 6}));
  EXPECT_EQ(out.map.rgb, (Floats{0, 0, 0, 0, 0, 0, 1, 0, 3, 4, 5, 6}));
  EXPECT_EQ(out.map.rejected_texels, 3);
  EXPECT_NE(out.warnings.find("3 texels"), std::string::npos);
}

TEST(ExrEnvironment, OtherPrimariesAreConvertedAndWhiteStaysWhite) {
  ExrMaker maker({"R", "G", "B"}, Imf::FLOAT, kTwoByOne);
  Imf::addChromaticities(maker.Header(), Imf::Chromaticities({0.708f, 0.292f}, {0.170f, 0.797f},
                                                             {0.131f, 0.046f}, {0.3127f, 0.3290f}));
  const Result out = Read(maker.Make({2, 2, 2, 0, 1, 0}));
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(out.map.rgb[i], 2, 1e-4);
  // Rec.2020 green leaves Rec.709: (-0.5876, 1.1329, -0.1006) by ITU-R BT.2407.
  EXPECT_EQ(out.map.rgb[3], 0);
  EXPECT_NEAR(out.map.rgb[4], 1.1329, 2e-4);
  EXPECT_EQ(out.map.rgb[5], 0);
  EXPECT_EQ(out.map.rejected_texels, 0);
  EXPECT_EQ(out.map.clamped_texels, 1);
}

TEST(ExrEnvironment, Rec709IsLeftAlone) {
  ExrMaker maker({"R", "G", "B"}, Imf::FLOAT, kTwoByOne);
  Imf::addChromaticities(maker.Header(), Imf::Chromaticities());
  EXPECT_EQ(Read(maker.Make({0.1f, 0.2f, 0.3f, 4, 5, 6})).map.rgb,
            (Floats{0.1f, 0.2f, 0.3f, 4, 5, 6}));
}

TEST(ExrEnvironment, BadFilesAreNamed) {
  ExrMaker no_rgb({"Z"}, Imf::FLOAT, kTwoByOne);
  EXPECT_NE(Read(no_rgb.Make({1, 2})).error.find("neither channels"), std::string::npos);
  ExrMaker cube({"R", "G", "B"}, Imf::FLOAT, kTwoByOne);
  Imf::addEnvmap(cube.Header(), Imf::ENVMAP_CUBE);
  EXPECT_NE(Read(cube.Make({1, 2, 3, 4, 5, 6})).error.find("cube map"), std::string::npos);
  ExrMaker good({"R", "G", "B"}, Imf::FLOAT, kTwoByOne);
  const Bytes whole = good.Make({1, 2, 3, 4, 5, 6});
  for (size_t count = 0; count < whole.size(); ++count) {
    EXPECT_NE(Read(std::span(whole).first(count)).error, "") << count;
  }
}

TEST(Environment, FilesAreReadByPath) {
  const TemporaryFolder folder;
  WriteBytes(folder / "env.hdr", Hdr("-Y 1 +X 1", kOne));
  EXPECT_EQ(ReadEnvironment(folder / "env.hdr", {}).rgb, (Floats{1, 0.5f, 0.25f}));
  try {
    ReadEnvironment(folder / "missing.hdr", {});
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("missing.hdr: no such file"), std::string::npos);
  }
}

TEST(Primaries, KnownMatrices) {
  const Matrix3 same = ToRec709({});
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) EXPECT_NEAR(same[i][j], i == j ? 1 : 0, 1e-12);
  }
  // AP0 (ACES) to Rec.709 with Bradford adaptation, as published in the ACES colour transforms.
  const Matrix3 aces = ToRec709({{0.7347, 0.2653}, {0, 1}, {0.0001, -0.077}, {0.32168, 0.33767}});
  const Matrix3 published = {{{2.52168618674388, -1.13413098823972, -0.387555198504164},
                              {-0.276479914229922, 1.37271908766826, -0.096239173438334},
                              {-0.0153780649660342, -0.152975335867399, 1.16835340083343}}};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) EXPECT_NEAR(aces[i][j], published[i][j], 1e-9) << i << j;
  }
  EXPECT_THROW(ToRec709({{0.3, 0.3}, {0.3, 0.3}, {0.3, 0.3}, {0.3, 0.3}}), std::domain_error);
}

}  // namespace
}  // namespace carpool::render
