// Images in memory: PNG and JPEG in, smaller ones, JPEG out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

using Bytes = std::vector<std::byte>;

struct Image {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint8_t> rgb;  // three bytes a pixel, rows from the top
};

/// decode reads a PNG (over white, where it is transparent) or a JPEG. Throws std::runtime_error,
/// with a reason, for what is neither, is damaged, or has more than 100 million pixels.
Image decode(std::span<const std::byte> file);

/// shrink averages boxes of pixels, so that the longer side becomes `size`; a smaller image stays
/// as it is. Stored values are averaged, not light: good enough for a thumbnail.
Image shrink(const Image& image, std::uint32_t size);

/// encode writes a JPEG of quality 90. Throws std::runtime_error.
Bytes encode(const Image& image);
