// Tells image formats apart by their first bytes and hands them to their decoder.
#include "render/image/image_decode.h"

#include <algorithm>
#include <bit>
#include <string_view>

#include "render/image/image_codecs.h"

namespace carpool::render {
namespace {

static_assert(std::endian::native == std::endian::little, "texel words are little-endian, R first");

enum class FileFormat { png, jpeg };

bool StartsWith(std::span<const std::byte> bytes, std::string_view magic, size_t at = 0) {
  return bytes.size() >= at + magic.size() &&
         std::equal(magic.begin(), magic.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at),
                    [](char a, std::byte b) { return static_cast<std::byte>(a) == b; });
}

[[noreturn]] void RefuseFormat(std::span<const std::byte> bytes, const std::string& where) {
  if (bytes.empty()) throw InputError(where, "the image is empty; PNG or JPEG is needed");
  std::string kind = "an unknown format";
  if (StartsWith(bytes, "RIFF") && StartsWith(bytes, "WEBP", 8)) kind = "WebP";
  if (StartsWith(bytes, "\xabKTX 20")) kind = "KTX2";
  if (StartsWith(bytes, "GIF8")) kind = "GIF";
  if (StartsWith(bytes, "BM")) kind = "BMP";
  if (StartsWith(bytes, "DDS ")) kind = "DDS";
  throw InputError(where, "the image is in " + kind + "; convert it to PNG or JPEG");
}

FileFormat FormatOf(std::span<const std::byte> bytes, const std::string& where) {
  if (StartsWith(bytes, "\x89PNG\r\n\x1a\n")) return FileFormat::png;
  if (StartsWith(bytes, "\xff\xd8\xff")) return FileFormat::jpeg;
  RefuseFormat(bytes, where);
}

}  // namespace

void CheckImageSize(int64_t width, int64_t height, const std::string& where) {
  if (width < 1 || height < 1) throw InputError(where, "the image has no pixels");
  if (width > kMaxImageDimension || height > kMaxImageDimension ||
      width * height > kMaxImagePixels) {
    throw InputError(where, "the image has " + std::to_string(width) + " x " +
                                std::to_string(height) + " pixels; at most " +
                                std::to_string(kMaxImageDimension) + " a side and " +
                                std::to_string(kMaxImagePixels) + " in all can be read");
  }
}

ImageInfo ReadImageInfo(std::span<const std::byte> bytes, const std::string& where) {
  return FormatOf(bytes, where) == FileFormat::png ? ReadPngInfo(bytes, where)
                                                   : ReadJpegInfo(bytes, where);
}

void DecodeImage(std::span<const std::byte> bytes, const std::string& where, const ImageInfo& info,
                 std::span<uint32_t> words, const WarningSink& warn) {
  if (FormatOf(bytes, where) == FileFormat::png) {
    DecodePng(bytes, where, info, words);
  } else {
    DecodeJpeg(bytes, where, info, words, warn);
  }
}

}  // namespace carpool::render
