// What image_decode.cpp dispatches to: one decoder per file format. Internal to render/image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "render/base/error.h"
#include "render/image/image_decode.h"

namespace carpool::render {

ImageInfo ReadPngInfo(std::span<const std::byte> bytes, const std::string& where);
void DecodePng(std::span<const std::byte> bytes, const std::string& where, const ImageInfo& info,
               std::span<uint32_t> words);

ImageInfo ReadJpegInfo(std::span<const std::byte> bytes, const std::string& where);
void DecodeJpeg(std::span<const std::byte> bytes, const std::string& where, const ImageInfo& info,
                std::span<uint32_t> words, const WarningSink& warn);

/// Throws InputError if the size breaks the limits of image_decode.h.
void CheckImageSize(int64_t width, int64_t height, const std::string& where);

}  // namespace carpool::render
