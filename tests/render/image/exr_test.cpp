// EXR files: what is written is read back, the same planes give the same bytes, and bad files are
// named.
#include <gtest/gtest.h>

#include <ImfChannelList.h>
#include <ImfChromaticities.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfStandardAttributes.h>

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "render/base/error.h"
#include "render/image/exr_read.h"
#include "render/image/exr_write.h"
#include "tests/render/image/make_images.h"

namespace carpool::render {
namespace {

constexpr int kWidth = 37, kHeight = 23;

struct Planes {
  std::vector<float> r, depth;
  std::vector<uint32_t> id;
  ExrAttributes attributes = {
      {"carpool:scene", std::string("box.gltf")}, {"carpool:seconds", 1.5f}, {"carpool:seed", 7}};

  Planes() {
    std::mt19937 random(1);
    for (int i = 0; i < kWidth * kHeight; ++i) {
      r.push_back(static_cast<float>(random()) * 1e-9f);
      depth.push_back(std::bit_cast<float>(static_cast<uint32_t>(random()) & 0x7f7fffffu));
      id.push_back(static_cast<uint32_t>(random()));
    }
    depth[3] = std::numeric_limits<float>::infinity();
  }
  std::vector<ExrChannelView> Views() const {
    return {{"R", std::span<const float>(r)},
            {"depth.Z", std::span<const float>(depth)},
            {"object.id", std::span<const uint32_t>(id)}};
  }
};

TEST(Exr, ReadsBackEveryChannelAndAttribute) {
  const TemporaryFolder folder;
  const Planes planes;
  WriteExr(folder / "a.exr", kWidth, kHeight, planes.Views(), planes.attributes);
  const ExrImage image = ReadExr(folder / "a.exr");
  EXPECT_EQ(image.width, kWidth);
  EXPECT_EQ(image.height, kHeight);
  ASSERT_EQ(image.channels.size(), 3u);
  ASSERT_NE(image.FindFloats("R"), nullptr);
  EXPECT_EQ(*image.FindFloats("R"), planes.r);
  EXPECT_EQ(*image.FindFloats("depth.Z"), planes.depth);
  ASSERT_NE(image.FindIds("object.id"), nullptr);
  EXPECT_EQ(*image.FindIds("object.id"), planes.id);
  EXPECT_EQ(image.FindFloats("object.id"), nullptr);
  EXPECT_EQ(image.FindFloats("nothing"), nullptr);
  EXPECT_EQ(image.attributes, planes.attributes);
}

TEST(Exr, HasRec709ChromaticitiesAndZip) {
  const TemporaryFolder folder;
  const Planes planes;
  WriteExr(folder / "a.exr", kWidth, kHeight, planes.Views(), {});
  Imf::InputFile file((folder / "a.exr").c_str());
  EXPECT_EQ(file.header().compression(), Imf::ZIP_COMPRESSION);
  ASSERT_TRUE(Imf::hasChromaticities(file.header()));
  EXPECT_NEAR(Imf::chromaticities(file.header()).green.y, 0.60, 1e-6);
  EXPECT_NEAR(Imf::chromaticities(file.header()).white.x, 0.3127, 1e-6);
}

TEST(Exr, TheSamePlanesGiveTheSameBytes) {
  const TemporaryFolder folder;
  const Planes planes;
  std::vector<ExrChannelView> views = planes.Views();
  WriteExr(folder / "a.exr", kWidth, kHeight, views, planes.attributes);
  std::swap(views[0], views[2]);  // the order of the list does not matter either
  WriteExr(folder / "b.exr", kWidth, kHeight, views, planes.attributes);
  EXPECT_EQ(ReadBytes(folder / "a.exr"), ReadBytes(folder / "b.exr"));
  Planes other;
  other.r[5] += 1;
  WriteExr(folder / "b.exr", kWidth, kHeight, other.Views(), other.attributes);
  EXPECT_NE(ReadBytes(folder / "a.exr"), ReadBytes(folder / "b.exr"));
}

TEST(Exr, LongNamesAndAllSizesOfTheLastChunkAreRead) {
  const std::string name(100, 'n');
  for (int height = 1; height <= 33; ++height) {
    const TemporaryFolder folder;
    const std::vector<float> plane(static_cast<size_t>(5 * height), 0.25f);
    const std::array<ExrChannelView, 1> views = {{{name, std::span<const float>(plane)}}};
    WriteExr(folder / "a.exr", 5, height, views, {{name, 3}});
    const ExrImage image = ReadExr(folder / "a.exr");
    ASSERT_NE(image.FindFloats(name), nullptr);
    EXPECT_EQ(*image.FindFloats(name), plane) << height;
    EXPECT_EQ(image.attributes, (ExrAttributes{{name, 3}}));
  }
}

TEST(Exr, MistakesOfTheCallerAreNamed) {
  const TemporaryFolder folder;
  const Planes planes;
  std::vector<ExrChannelView> views = planes.Views();
  EXPECT_THROW(WriteExr(folder / "a.exr", kWidth + 1, kHeight, views, {}), std::invalid_argument);
  EXPECT_THROW(WriteExr(folder / "a.exr", kWidth, kHeight, views, {{"compression", 3}}),
               std::invalid_argument);
  views.push_back(views[0]);
  EXPECT_THROW(WriteExr(folder / "a.exr", kWidth, kHeight, views, {}), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.exr"));
}

TEST(Exr, AnUnwritablePlaceIsAnOutputError) {
  const TemporaryFolder folder;
  const Planes planes;
  try {
    WriteExr(folder / "missing/a.exr", kWidth, kHeight, planes.Views(), {});
    FAIL() << "no error";
  } catch (const OutputError& error) {
    EXPECT_EQ(error.code(), ExitCode::output_failed);
    EXPECT_NE(std::string(error.what()).find("missing/a.exr: cannot be written"),
              std::string::npos);
  }
}

TEST(Exr, EveryTruncationIsAnInputError) {
  const TemporaryFolder folder;
  const Planes planes;
  WriteExr(folder / "a.exr", kWidth, kHeight, planes.Views(), planes.attributes);
  const Bytes whole = ReadBytes(folder / "a.exr");
  for (size_t count = 0; count < whole.size(); count += 37) {
    EXPECT_THROW(DecodeExr(std::span(whole).first(count), "b.exr"), InputError) << count;
  }
  EXPECT_THROW(ReadExr(folder / "nothing.exr"), InputError);
  EXPECT_THROW(ReadExr(folder.Path()), InputError);
}

}  // namespace
}  // namespace carpool::render
