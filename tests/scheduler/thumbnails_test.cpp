// The example `thumbnails`: known pixels, bad files, bounded memory, stopping and going on.
#include "thumbnails.h"

#include <gtest/gtest.h>

#include <png.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "files.h"
#include "image.h"
#include "tests/tools/process.h"

namespace {

namespace fs = std::filesystem;

Image plain(std::uint32_t width, std::uint32_t height, std::array<std::uint8_t, 3> color) {
  Image image{.width = width, .height = height, .rgb = {}};
  for (std::uint32_t i = 0; i < width * height; ++i) {
    image.rgb.insert(image.rgb.end(), color.begin(), color.end());
  }
  return image;
}

void write_png(const fs::path& path, const Image& image) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = image.width;
  png.height = image.height;
  png.format = PNG_FORMAT_RGB;
  ASSERT_NE(png_image_write_to_file(&png, path.c_str(), 0, image.rgb.data(), 0, nullptr), 0);
}

void write_bytes(const fs::path& path, const Bytes& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

Bytes read_bytes(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(in), {});
  const auto* begin = reinterpret_cast<const std::byte*>(text.data());
  return {begin, begin + text.size()};
}

TEST(ShrinkTest, AveragesBoxes) {
  Image image{.width = 4, .height = 2, .rgb = {}};
  for (const int value : {0, 10, 100, 200, 20, 30, 100, 201}) {
    image.rgb.insert(image.rgb.end(), 3, static_cast<std::uint8_t>(value));
  }
  const Image small = shrink(image, 2);
  EXPECT_EQ(small.width, 2U);
  EXPECT_EQ(small.height, 1U);
  EXPECT_EQ(small.rgb, (std::vector<std::uint8_t>{15, 15, 15, 150, 150, 150}));
}

TEST(ShrinkTest, KeepsTheShapeAndSmallImages) {
  EXPECT_EQ(shrink(plain(1000, 10, {1, 2, 3}), 100).height, 1U);
  EXPECT_EQ(shrink(plain(3, 1000, {1, 2, 3}), 100).width, 1U);  // never none
  EXPECT_EQ(shrink(plain(333, 1000, {1, 2, 3}), 100).width, 33U);
  EXPECT_EQ(shrink(plain(30, 20, {1, 2, 3}), 100).width, 30U);
}

class ThumbnailsTest : public testing::Test {
 protected:
  ThumbnailsTest() {
    fs::create_directories(from_ / "deeper");
    options_.from = from_;
    options_.to = folder_ / "to";
    options_.size = 32;
    options_.run.threads = 3;
    options_.on_bad = [this](const fs::path& path, const std::string& reason) {
      bad_[path.filename()] = reason;
    };
  }

  static std::array<std::uint8_t, 3> color_of(std::uint32_t i) {
    return {static_cast<std::uint8_t>(i * 7), static_cast<std::uint8_t>(i * 5),
            static_cast<std::uint8_t>(255 - i)};
  }

  // Half of them PNGs, half JPEGs, some in a folder below; returns the path below `from_`.
  static std::string name_of(std::uint32_t i) {
    return (i % 5 == 0 ? "deeper/" : "") + std::to_string(i) + (i % 2 == 0 ? ".png" : ".JPG");
  }
  void write_images(std::uint32_t count) const {
    for (std::uint32_t i = 0; i < count; ++i) {
      const Image image = plain(40 + i % 50, 64, color_of(i));
      const fs::path path = from_ / name_of(i);
      i % 2 == 0 ? write_png(path, image) : write_bytes(path, encode(image));
    }
  }
  fs::path thumbnail(std::uint32_t i) const { return options_.to / (name_of(i) + ".jpg"); }

  void expect_thumbnail(std::uint32_t i) const {
    const Image image = decode(read_bytes(thumbnail(i)));
    EXPECT_EQ(std::max(image.width, image.height), 32U);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      EXPECT_NEAR(image.rgb[image.rgb.size() / 6 * 3 + channel], color_of(i)[channel], 4) << i;
    }
  }
  std::size_t files_made() const {
    std::size_t count = 0;
    for (const auto& entry : fs::recursive_directory_iterator(options_.to)) {
      count += entry.is_regular_file() ? 1 : 0;
    }
    return count;
  }

  const carpool::tests::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_ / "";
  const fs::path from_ = folder_ / "from";
  ThumbnailOptions options_;
  std::map<std::string, std::string> bad_;
};

TEST_F(ThumbnailsTest, EveryImageHasOne) {
  write_images(60);
  write_bytes(from_ / "notes.txt", {});  // not an image
  const ThumbnailSummary summary = make_thumbnails(options_);
  EXPECT_EQ(summary.made, 60U);
  EXPECT_EQ(summary.bad + summary.left + summary.up_to_date, 0U);
  for (std::uint32_t i = 0; i < 60; ++i) {
    expect_thumbnail(i);
  }
  EXPECT_EQ(files_made(), 60U);  // and nothing half done
}

TEST_F(ThumbnailsTest, BadFilesAreReportedAndSkipped) {
  write_images(10);
  Bytes cut = read_bytes(from_ / name_of(2));
  cut.resize(cut.size() / 2);
  write_bytes(from_ / "cut.png", cut);
  cut = read_bytes(from_ / name_of(1));
  cut.resize(100);
  write_bytes(from_ / "cut.jpg", cut);
  cut = read_bytes(from_ / name_of(1));
  cut.resize(cut.size() - 20);  // in the middle of the pixels
  write_bytes(from_ / "short.jpg", cut);
  write_bytes(from_ / "empty.jpeg", {});
  write_bytes(from_ / "text.png", Bytes(1000, std::byte{'x'}));
  Bytes huge = read_bytes(from_ / name_of(2));
  std::fill(huge.begin() + 16, huge.begin() + 24, std::byte{0x70});  // width and height
  write_bytes(from_ / "huge.png", huge);
  fs::create_symlink(from_ / "nowhere",
                     from_ / "dangling.png");  // no regular file: not one of them
  const ThumbnailSummary summary = make_thumbnails(options_);
  EXPECT_EQ(summary.made, 10U);
  EXPECT_EQ(summary.bad, 6U);
  EXPECT_EQ(bad_.size(), 6U);
  for (const char* name :
       {"cut.png", "cut.jpg", "short.jpg", "empty.jpeg", "text.png", "huge.png"}) {
    EXPECT_FALSE(bad_[name].empty()) << name;
  }
  EXPECT_EQ(files_made(), 10U);
}

TEST_F(ThumbnailsTest, WhatIsUpToDateIsLeftAlone) {
  write_images(20);
  EXPECT_EQ(make_thumbnails(options_).made, 20U);
  EXPECT_EQ(make_thumbnails(options_).up_to_date, 20U);
  fs::last_write_time(from_ / name_of(3), fs::file_time_type::clock::now() + std::chrono::hours(1));
  const ThumbnailSummary third = make_thumbnails(options_);
  EXPECT_EQ(third.made, 1U);
  EXPECT_EQ(third.up_to_date, 19U);
}

TEST_F(ThumbnailsTest, GoesOnWhereItWasStopped) {
  write_images(60);
  options_.run.cancel = carpool::CancelToken();
  options_.run.progress_every = std::chrono::milliseconds(0);
  options_.on_progress = [&](std::uint64_t done, std::uint64_t all) {
    EXPECT_EQ(all, 60U);
    if (done >= 10) {
      options_.run.cancel.cancel();
    }
  };
  const ThumbnailSummary first = make_thumbnails(options_);
  EXPECT_EQ(first.report.outcome, carpool::Outcome::cancelled);
  EXPECT_EQ(first.made + first.left, 60U);
  EXPECT_GT(first.left, 0U);
  options_.run.cancel = carpool::CancelToken();
  options_.on_progress = nullptr;
  const ThumbnailSummary second = make_thumbnails(options_);
  EXPECT_EQ(second.up_to_date, first.made);
  EXPECT_EQ(second.made, first.left);
  for (std::uint32_t i = 0; i < 60; ++i) {
    expect_thumbnail(i);
  }
}

TEST_F(ThumbnailsTest, FewImagesAreInMemoryAtOnce) {
  write_images(60);
  options_.in_flight = 3;
  EXPECT_LE(make_thumbnails(options_).report.peak_in_flight, 3U);
  EXPECT_EQ(files_made(), 60U);
}

TEST_F(ThumbnailsTest, AFolderThatCannotBeWrittenEndsTheRun) {
  write_images(5);
  options_.to = from_ / name_of(2);  // a file
  EXPECT_THROW(make_thumbnails(options_), WriteError);
}

TEST_F(ThumbnailsTest, AThumbnailThatCannotBeWrittenLeavesNothingHalfDone) {
  write_images(1);
  fs::create_directories(thumbnail(0));  // a folder of that name
  EXPECT_THROW(make_thumbnails(options_), WriteError);
  EXPECT_EQ(files_made(), 0U);
}

TEST_F(ThumbnailsTest, ThumbnailsAreNotMadeOfThumbnails) {
  write_images(10);
  options_.to = from_ / "deeper" / "small";
  EXPECT_EQ(make_thumbnails(options_).made, 10U);
  EXPECT_EQ(make_thumbnails(options_).up_to_date, 10U);
  EXPECT_EQ(files_made(), 10U);
  options_.to = from_ / "deeper" / "..";
  EXPECT_THROW(make_thumbnails(options_), std::invalid_argument);
}

TEST_F(ThumbnailsTest, AMissingFolderIsNamed) {
  options_.from = folder_ / "nowhere";
  EXPECT_THROW(make_thumbnails(options_), ReadError);
}

using carpool::tests::Outcome;

Outcome program(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), THUMBNAILS_PROGRAM);
  return carpool::tests::Process(arguments).Wait();
}

TEST_F(ThumbnailsTest, TheProgramSaysHowItIsUsed) {
  const Outcome help = program({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.out.find("--in-flight"), std::string::npos) << help.out;
  EXPECT_EQ(help.err, "");
  const std::vector<std::string> wrong[] = {{},
                                            {"a"},
                                            {"a", "b", "c"},
                                            {"a", "b", "--size"},
                                            {"a", "b", "--size", "0"},
                                            {"a", "b", "--size", "x"},
                                            {"a", "b", "--in-flight", "3x"},
                                            {"a", "b", "--threads", "-1"},
                                            {"a", "b", "--bogus"}};
  for (const auto& arguments : wrong) {
    const Outcome outcome = program(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
}

TEST_F(ThumbnailsTest, TheProgramsExitCodesTellHowItWent) {
  write_images(20);
  const std::string to = options_.to;
  Outcome outcome = program({from_, to, "--size", "32"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "20 made, 0 up to date, 0 bad, 0 left\n");
  write_bytes(from_ / "text.png", Bytes(1000, std::byte{'x'}));
  outcome = program({from_, to, "--quiet", "--threads", "1"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.out, "0 made, 20 up to date, 1 bad, 0 left\n");
  EXPECT_EQ(outcome.err, "thumbnails: skipped " + (from_ / "text.png").string() +
                             ": neither a PNG nor a JPEG\n");
  EXPECT_EQ(program({from_, from_}).exit_code, 2);
  outcome = program({folder_ / "nowhere", to});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.err.find("nowhere"), std::string::npos) << outcome.err;
  EXPECT_EQ(program({from_, from_ / name_of(2), "--quiet"}).exit_code, 4);
}

}  // namespace
