// Encodes small images for the tests, by other means than the code under test.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace carpool::render {

using Bytes = std::vector<std::byte>;

/// What to put in a PNG. `rows` are packed as the file has them (16 bits: most significant byte
/// first).
struct PngRecipe {
  int width = 1;
  int height = 1;
  int bit_depth = 8;
  int color_type = 2;  // 0 grey, 2 RGB, 3 palette, 4 grey and alpha, 6 RGBA
  bool interlaced = false;
  std::vector<uint8_t> palette = {};       // RGB triples
  std::vector<uint8_t> transparency = {};  // tRNS alphas of the palette
  int transparent_grey = -1;               // tRNS of a grey image
  std::vector<uint8_t> rows = {};
};
Bytes MakePng(const PngRecipe& recipe);

/// An RGBA PNG with the given texels, R first.
Bytes MakeRgbaPng(int width, int height, std::span<const uint32_t> texels);

enum class JpegKind { grey, rgb, cmyk };
/// A JPEG of quality 100 without chroma subsampling whose pixels all equal `color`.
Bytes MakeJpeg(int width, int height, JpegKind kind, std::span<const uint8_t> color);

Bytes ToBytes(const std::string& text);

/// A folder of its own for a test, removed with all it holds.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& Path() const { return path_; }

 private:
  std::filesystem::path path_;
};

Bytes ReadBytes(const std::filesystem::path& path);
void WriteBytes(const std::filesystem::path& path, std::span<const std::byte> bytes);

}  // namespace carpool::render
