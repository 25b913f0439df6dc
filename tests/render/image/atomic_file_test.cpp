// Atomic replacement: the old contents survive every failure, links and modes stay, no temporary is
// left.
#include "render/posix/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <iterator>

#include "render/base/error.h"
#include "render/image/image_decode.h"
#include "render/image/png_write.h"
#include "tests/render/image/make_images.h"

namespace carpool::render {
namespace {

namespace fs = std::filesystem;

size_t FilesIn(const fs::path& folder) {
  return static_cast<size_t>(std::distance(fs::directory_iterator(folder), {}));
}

TEST(AtomicFile, CreatesAndReplaces) {
  const TemporaryFolder folder;
  WriteFileAtomically(folder / "f", ToBytes("one"));
  EXPECT_EQ(ReadBytes(folder / "f"), ToBytes("one"));
  WriteFileAtomically(folder / "f", ToBytes("two"));
  EXPECT_EQ(ReadBytes(folder / "f"), ToBytes("two"));
  EXPECT_EQ(FilesIn(folder.Path()), 1u);
}

/// Files may not grow beyond `bytes` while this lives: a full disk in small.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &old_);
    const rlimit limit{bytes, old_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &old_);
    std::signal(SIGXFSZ, SIG_DFL);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit old_{};
};

TEST(AtomicFile, AFullDiskLeavesTheOldFile) {
  const TemporaryFolder folder;
  WriteFileAtomically(folder / "f", ToBytes("old"));
  {
    const FileSizeLimit limit(1000);
    EXPECT_THROW(WriteFileAtomically(folder / "f", Bytes(5000)), OutputError);
  }
  EXPECT_EQ(ReadBytes(folder / "f"), ToBytes("old"));
  EXPECT_EQ(FilesIn(folder.Path()), 1u);
}

TEST(AtomicFile, FollowsLinksAndKeepsModes) {
  const TemporaryFolder folder;
  WriteFileAtomically(folder / "real", ToBytes("old"));
  fs::permissions(folder / "real", fs::perms(0640));
  fs::create_symlink("real", folder / "link");
  WriteFileAtomically(folder / "link", ToBytes("new"));
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(ReadBytes(folder / "real"), ToBytes("new"));
  EXPECT_EQ(fs::status(folder / "real").permissions(), fs::perms(0640));
}

TEST(AtomicFile, DevicesStayDevices) {
  WriteFileAtomically("/dev/null", ToBytes("gone"));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_THROW(WriteFileAtomically("/dev/full", ToBytes("x")), OutputError);
}

TEST(AtomicFile, FoldersAndMissingFoldersAreOutputErrors) {
  const TemporaryFolder folder;
  EXPECT_THROW(WriteFileAtomically(folder.Path(), ToBytes("x")), OutputError);
  EXPECT_THROW(WriteFileAtomically(folder / "no/f", ToBytes("x")), OutputError);
  EXPECT_THROW(CheckWritable(folder / "no/f"), OutputError);
  EXPECT_NO_THROW(CheckWritable(folder / "f"));
  EXPECT_EQ(FilesIn(folder.Path()), 0u);
}

TEST(PngWrite, IsReadBackAndMarkedSrgb) {
  const TemporaryFolder folder;
  const std::array<uint8_t, 12> rgb = {1, 2, 3, 4, 5, 6, 7, 8, 9, 250, 251, 252};
  WritePng(folder / "a.png", 2, 2, rgb);
  const Bytes bytes = ReadBytes(folder / "a.png");
  const ImageInfo info = ReadImageInfo(bytes, "a.png");
  ASSERT_EQ(info.width, 2);
  ASSERT_EQ(info.height, 2);
  std::array<uint32_t, 4> words{};
  DecodeImage(bytes, "a.png", info, words, {});
  EXPECT_EQ(words, (std::array<uint32_t, 4>{0xff030201u, 0xff060504u, 0xff090807u, 0xfffcfbfau}));
  const Bytes chunk = ToBytes("sRGB");
  EXPECT_NE(std::search(bytes.begin(), bytes.end(), chunk.begin(), chunk.end()), bytes.end());
  EXPECT_THROW(WritePng(folder / "a.png", 3, 2, rgb), std::invalid_argument);
}

}  // namespace
}  // namespace carpool::render
