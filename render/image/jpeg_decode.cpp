// JPEG into RGBA texels through TurboJPEG.
#include <turbojpeg.h>

#include <memory>
#include <string_view>
#include <type_traits>

#include "render/image/image_codecs.h"

namespace carpool::render {
namespace {

struct DestroyHandle {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using Decompressor = std::unique_ptr<std::remove_pointer_t<tjhandle>, DestroyHandle>;

struct Header {
  int width = 0;
  int height = 0;
  int colorspace = 0;
};

Decompressor MakeDecompressor() {
  Decompressor made(tjInitDecompress());
  if (made == nullptr) throw std::bad_alloc();
  return made;
}

const unsigned char* Data(std::span<const std::byte> bytes) {
  return reinterpret_cast<const unsigned char*>(bytes.data());
}

/// Oddities that leave every pixel intact; other warnings mean that pixels were lost.
bool IsHarmless(std::string_view warning) {
  return warning.find("extraneous bytes") != std::string_view::npos ||
         warning.find("Invalid SOS parameters") != std::string_view::npos;
}

/// Throws if a call failed with `result`; returns the warning if it was a harmless one, else "".
std::string CheckResult(tjhandle handle, int result, const std::string& where) {
  if (result == 0) return "";
  std::string message = tjGetErrorStr2(handle);
  if (tjGetErrorCode(handle) == TJERR_WARNING && IsHarmless(message)) return message;
  throw InputError(where, "bad JPEG: " + message);
}

Header ReadHeader(tjhandle handle, std::span<const std::byte> bytes, const std::string& where) {
  Header header;
  int subsampling = 0;
  CheckResult(handle,
              tjDecompressHeader3(handle, Data(bytes), bytes.size(), &header.width, &header.height,
                                  &subsampling, &header.colorspace),
              where);
  CheckImageSize(header.width, header.height, where);
  // A block of 8 x 8 pixels takes one bit at least: 512 pixels a byte.
  if (int64_t{header.width} * header.height > 1024 * static_cast<int64_t>(bytes.size())) {
    throw InputError(where, "bad JPEG: the header claims more pixels than the file can hold");
  }
  return header;
}

/// CMYK in JPEG files is stored inverted (Adobe's convention): 255 is no ink.
void ConvertCmyk(std::span<uint32_t> words) {
  const auto multiply = [](uint32_t a, uint32_t b) { return (a * b + 127) / 255; };
  for (uint32_t& word : words) {
    const uint32_t k = word >> 24;
    const uint32_t r = multiply(word & 0xff, k);
    const uint32_t g = multiply(word >> 8 & 0xff, k);
    const uint32_t b = multiply(word >> 16 & 0xff, k);
    word = r | g << 8 | b << 16 | 0xff000000u;
  }
}

}  // namespace

ImageInfo ReadJpegInfo(std::span<const std::byte> bytes, const std::string& where) {
  const Decompressor decompressor = MakeDecompressor();
  const Header header = ReadHeader(decompressor.get(), bytes, where);
  return {header.width, header.height, stages::TexelFormat::rgba8};
}

void DecodeJpeg(std::span<const std::byte> bytes, const std::string& where, const ImageInfo& info,
                std::span<uint32_t> words, const WarningSink& warn) {
  const Decompressor decompressor = MakeDecompressor();
  const tjhandle handle = decompressor.get();
  const Header header = ReadHeader(handle, bytes, where);
  const bool cmyk = header.colorspace == TJCS_CMYK || header.colorspace == TJCS_YCCK;
  const int result = tjDecompress2(
      handle, Data(bytes), bytes.size(), reinterpret_cast<unsigned char*>(words.data()), info.width,
      0, info.height, cmyk ? TJPF_CMYK : TJPF_RGBA, TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS);
  const std::string warning = CheckResult(handle, result, where);
  if (warn && !warning.empty()) warn(where + ": odd JPEG, but readable: " + warning);
  if (cmyk) ConvertCmyk(words);
}

}  // namespace carpool::render
