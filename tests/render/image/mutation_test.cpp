// Mutated files: whatever bytes come, the readers give an image or an InputError. Fixed seeds; set
// CARPOOL_MUTATIONS to run more than the default number per file.
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfTiledOutputFile.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <random>

#include "render/image/environment_read.h"
#include "render/image/exr_read.h"
#include "render/image/image_decode.h"
#include "tests/render/image/make_images.h"

namespace carpool::render {
namespace {

int MutationCount() {
  const char* text = std::getenv("CARPOOL_MUTATIONS");
  return text != nullptr ? std::atoi(text) : 400;
}

class Mutator {
 public:
  explicit Mutator(uint32_t seed) : random_(seed) {}

  Bytes Mutate(Bytes bytes) {
    const size_t changes = 1 + Below(4);
    for (size_t i = 0; i < changes && !bytes.empty(); ++i) Change(bytes);
    return bytes;
  }
  size_t Below(size_t n) { return random_() % n; }

 private:
  void Change(Bytes& bytes) {
    // Headers are where sizes and counts are: half of the changes go there.
    const size_t reach = Below(2) == 0 ? std::min<size_t>(bytes.size(), 400) : bytes.size();
    const size_t at = Below(reach);
    const auto position = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    switch (Below(6)) {
      case 0:
        bytes[at] ^= static_cast<std::byte>(1u << Below(8));
        break;
      case 1:
        bytes[at] = static_cast<std::byte>(Below(256));
        break;
      case 2: {  // a value at the edge of its range
        constexpr std::array kEdges = {std::byte{0}, std::byte{1}, std::byte{0x7f}, std::byte{0x80},
                                       std::byte{0xff}};
        const size_t count = std::min<size_t>(1 + Below(4), bytes.size() - at);
        std::fill_n(position, count, kEdges[Below(kEdges.size())]);
        break;
      }
      case 3:
        bytes.resize(at);
        break;
      case 4:
        bytes.erase(position, position + static_cast<std::ptrdiff_t>(
                                             std::min<size_t>(1 + Below(8), bytes.size() - at)));
        break;
      default: {  // a piece twice
        const size_t count = std::min<size_t>(1 + Below(40), bytes.size() - at);
        const Bytes piece(position, position + static_cast<std::ptrdiff_t>(count));
        bytes.insert(position, piece.begin(), piece.end());
      }
    }
  }

  std::mt19937 random_;
};

/// Runs `read` on mutations of `seed_file`. Anything but success and InputError escapes and fails
/// the test; that both happen shows that the mutations are neither all deadly nor all harmless.
void ReadMutations(
    const Bytes& seed_file, const std::function<void(const Bytes&)>& read,
    const std::function<void(Bytes&)>& repair = [](Bytes&) {}) {
  ASSERT_NO_THROW(read(seed_file));
  Mutator mutator(20);
  const int count = MutationCount();
  int refused = 0;
  for (int i = 0; i < count; ++i) {
    Bytes bytes = mutator.Mutate(seed_file);
    if (mutator.Below(2) == 0) repair(bytes);
    try {
      read(bytes);
    } catch (const InputError& error) {
      ++refused;
      ASSERT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
  EXPECT_GT(refused, count / 20);
  EXPECT_LT(refused, count);
}

void Decode(const Bytes& bytes) {
  const ImageInfo info = ReadImageInfo(bytes, "file");
  std::vector<uint32_t> words(static_cast<size_t>(info.Words()));
  DecodeImage(bytes, "file", info, words, {});
}

uint32_t PngCrc(std::span<const std::byte> bytes) {
  uint32_t crc = ~0u;
  for (const std::byte byte : bytes) {
    crc ^= static_cast<uint32_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? 0xedb88320u : 0);
  }
  return ~crc;
}

/// Makes the checksums right again, so that mutations reach the code behind them.
void RepairPng(Bytes& bytes) {
  for (size_t at = 8; at + 12 <= bytes.size();) {
    size_t length = 0;
    for (size_t i = 0; i < 4; ++i) length = length << 8 | static_cast<size_t>(bytes[at + i]);
    if (length > bytes.size() - at - 12) return;
    const uint32_t crc = PngCrc(std::span(bytes).subspan(at + 4, length + 4));
    for (size_t i = 0; i < 4; ++i) {
      bytes[at + 8 + length + i] = static_cast<std::byte>(crc >> (24 - 8 * i));
    }
    at += 12 + length;
  }
}

std::vector<uint8_t> Noise(size_t count) {
  std::mt19937 random(7);
  std::vector<uint8_t> noise(count);
  for (uint8_t& byte : noise) byte = static_cast<uint8_t>(random());
  return noise;
}

TEST(Mutations, Png) {
  ReadMutations(MakePng({9, 7, 8, 6, true, {}, {}, -1, Noise(9 * 7 * 4)}), Decode, RepairPng);
  ReadMutations(MakePng({9, 7, 16, 2, false, {}, {}, -1, Noise(9 * 7 * 6)}), Decode, RepairPng);
  ReadMutations(MakePng({16, 7, 4, 3, false, Noise(48), Noise(5), -1, Noise(8 * 7)}), Decode,
                RepairPng);
}

Bytes NoiseJpeg(int flags) {
  const std::vector<uint8_t> rgb = Noise(33 * 17 * 3);
  tjhandle handle = tjInitCompress();
  unsigned char* data = nullptr;
  unsigned long size = 0;
  const int result =
      tjCompress2(handle, rgb.data(), 33, 0, 17, TJPF_RGB, &data, &size, TJSAMP_420, 60, flags);
  Bytes out(size);
  if (result == 0) std::memcpy(out.data(), data, size);
  tjFree(data);
  tjDestroy(handle);
  EXPECT_EQ(result, 0);
  return out;
}

TEST(Mutations, Jpeg) {
  ReadMutations(NoiseJpeg(0), Decode);
  ReadMutations(NoiseJpeg(TJFLAG_PROGRESSIVE), Decode);
  ReadMutations(MakeJpeg(17, 9, JpegKind::cmyk, std::array<uint8_t, 4>{1, 2, 3, 4}), Decode);
}

void ReadAsEnvironment(const Bytes& bytes) {
  DecodeEnvironment(bytes, "file", {});
}
void ReadAsExr(const Bytes& bytes) {
  DecodeExr(bytes, "file");
}

TEST(Mutations, Radiance) {
  const std::string flat = "#?RADIANCE\nEXPOSURE=1.5\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 3\n";
  const std::string runs = std::string("\x01\x02\x03\x80\x01\x01\x01\x02", 8);
  ReadMutations(ToBytes(flat + runs + runs), ReadAsEnvironment);
  const std::string line =
      std::string("\x02\x02\x00\x08\x88\x80\x04\x40\x40\x40\x40\x84\x40\x88\x20\x88\x81", 17);
  ReadMutations(
      ToBytes(
          "#?RGBE\nPRIMARIES=.7 .3 .2 .7 .1 .05 .33 .33\nFORMAT=32-bit_rle_rgbe\n\n+X 2 -Y 8\n" +
          line + line),
      ReadAsEnvironment);
}

Bytes NoiseExr(Imf::Compression compression, bool tiled) {
  constexpr int kWidth = 41, kHeight = 35;
  Imf::Header header(kWidth, kHeight);
  header.compression() = compression;
  const std::vector<uint8_t> noise = Noise(kWidth * kHeight * 4);
  std::vector<float> plane;
  for (const uint8_t byte : noise) plane.push_back(byte / 16.0f);
  Imf::FrameBuffer frame;
  for (const char* name : {"R", "G", "B"}) {
    header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    frame.insert(name,
                 Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(plane.data()), 4, 4 * kWidth));
  }
  const TemporaryFolder folder;
  const std::string path = (folder / "a.exr").string();
  if (tiled) {
    header.setTileDescription(Imf::TileDescription(16, 16, Imf::MIPMAP_LEVELS));
    Imf::TiledOutputFile file(path.c_str(), header);
    file.setFrameBuffer(frame);
    for (int level = 0; level < file.numLevels(); ++level) {
      file.writeTiles(0, file.numXTiles(level) - 1, 0, file.numYTiles(level) - 1, level);
    }
  } else {
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(frame);
    file.writePixels(kHeight);
  }
  return ReadBytes(path);
}

TEST(Mutations, Exr) {
  for (const Imf::Compression compression :
       {Imf::NO_COMPRESSION, Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION, Imf::DWAA_COMPRESSION}) {
    for (const bool tiled : {false, true}) {
      SCOPED_TRACE(std::to_string(compression) + (tiled ? " tiled" : " lines"));
      const Bytes exr = NoiseExr(compression, tiled);
      ReadMutations(exr, ReadAsEnvironment);
      ReadMutations(exr, ReadAsExr);
    }
  }
}

}  // namespace
}  // namespace carpool::render
