// Decodes the PNG and JPEG files of a scene into RGBA texels of the file's own bit depth.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "render/base/error.h"
#include "stages/tables/materials.h"

namespace carpool::render {

/// Larger images are refused from their header, before anything is allocated. So are headers that
/// claim more pixels than the file's bytes could hold at the best compression their format has.
constexpr int64_t kMaxImageDimension = 65536;
constexpr int64_t kMaxImagePixels = int64_t{1} << 28;  // 16384 x 16384

struct ImageInfo {
  int width = 0;
  int height = 0;
  stages::TexelFormat format = stages::TexelFormat::rgba8;  // rgba16 for PNG with 16 bits a channel

  int64_t Words() const {
    return int64_t{width} * height * (format == stages::TexelFormat::rgba16 ? 2 : 1);
  }
};

/// Reads the header alone. Throws InputError(where, ...) for anything but a PNG or JPEG of sane
/// size.
ImageInfo ReadImageInfo(std::span<const std::byte> bytes, const std::string& where);

/// Decodes into `words`, `info.Words()` long, in the layout of stages::Texture level 0. Grey,
/// palette and CMYK become RGB, absent alpha 1, tRNS becomes alpha; colour profiles and gamma are
/// ignored, as glTF demands. Throws InputError(where, ...) for truncated or corrupt data; harmless
/// oddities are warned of.
void DecodeImage(std::span<const std::byte> bytes, const std::string& where, const ImageInfo& info,
                 std::span<uint32_t> words, const WarningSink& warn);

}  // namespace carpool::render
