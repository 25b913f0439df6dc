// libpng's simple interface, TurboJPEG, and a box filter.
#include "image.h"

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>

#include <png.h>
#include <turbojpeg.h>

namespace {

constexpr std::uint64_t kMostPixels = 100'000'000;

void check_size(std::uint64_t width, std::uint64_t height) {
  if (width * height == 0 || width * height > kMostPixels) {
    throw std::runtime_error("its size is " + std::to_string(width) + "x" + std::to_string(height));
  }
}

Image decode_png(std::span<const std::byte> file) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  const std::unique_ptr<png_image, decltype(&png_image_free)> owner(&png, &png_image_free);
  if (png_image_begin_read_from_memory(&png, file.data(), file.size()) == 0) {
    throw std::runtime_error(png.message);
  }
  check_size(png.width, png.height);
  png.format = PNG_FORMAT_RGB;
  Image image{.width = png.width,
              .height = png.height,
              .rgb = std::vector<std::uint8_t>(PNG_IMAGE_SIZE(png))};
  const png_color white{255, 255, 255};
  if (png_image_finish_read(&png, &white, image.rgb.data(), 0, nullptr) == 0) {
    throw std::runtime_error(png.message);
  }
  return image;
}

struct DestroyHandle {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using TurboHandle = std::unique_ptr<std::remove_pointer_t<tjhandle>, DestroyHandle>;

void check(tjhandle handle, int result) {
  if (result != 0) {
    throw std::runtime_error(tjGetErrorStr2(handle));
  }
}

Image decode_jpeg(std::span<const std::byte> file) {
  const TurboHandle handle(tjInitDecompress());
  const auto* data = reinterpret_cast<const unsigned char*>(file.data());
  int width = 0, height = 0, subsampling = 0, colorspace = 0;
  check(handle.get(), tjDecompressHeader3(handle.get(), data, file.size(), &width, &height,
                                          &subsampling, &colorspace));
  check_size(static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height));
  Image image{.width = static_cast<std::uint32_t>(width),
              .height = static_cast<std::uint32_t>(height),
              .rgb = std::vector<std::uint8_t>(std::size_t{3} * static_cast<std::size_t>(width) *
                                               static_cast<std::size_t>(height))};
  check(handle.get(), tjDecompress2(handle.get(), data, file.size(), image.rgb.data(), width, 0,
                                    height, TJPF_RGB, 0));
  return image;
}

struct Range {
  std::uint32_t begin;
  std::uint32_t end;
};

// The pixels of a side of `from` that become pixel i of one of `to`.
Range range_of(std::uint32_t i, std::uint32_t from, std::uint32_t to) {
  const auto edge = [&](std::uint64_t at) { return static_cast<std::uint32_t>(at * from / to); };
  return {edge(i), edge(std::uint64_t{i} + 1)};
}

void append_average(const Image& image, Range rows, Range columns, std::vector<std::uint8_t>& rgb) {
  const std::uint64_t pixels = std::uint64_t{rows.end - rows.begin} * (columns.end - columns.begin);
  std::array<std::uint64_t, 3> sums;
  sums.fill(pixels / 2);  // rounds
  for (std::uint32_t row = rows.begin; row < rows.end; ++row) {
    const std::uint8_t* at = &image.rgb[(std::size_t{row} * image.width + columns.begin) * 3];
    for (std::uint32_t column = columns.begin; column < columns.end; ++column, at += 3) {
      for (std::size_t channel = 0; channel < 3; ++channel) {
        sums[channel] += at[channel];
      }
    }
  }
  for (const std::uint64_t sum : sums) {
    rgb.push_back(static_cast<std::uint8_t>(sum / pixels));
  }
}

}  // namespace

Image decode(std::span<const std::byte> file) {
  const auto starts_with = [&](std::initializer_list<unsigned> magic) {
    return file.size() > magic.size() &&
           std::equal(magic.begin(), magic.end(), file.begin(),
                      [](unsigned a, std::byte b) { return a == std::to_integer<unsigned>(b); });
  };
  if (starts_with({0x89, 'P', 'N', 'G'})) {
    return decode_png(file);
  }
  if (starts_with({0xff, 0xd8, 0xff})) {
    return decode_jpeg(file);
  }
  throw std::runtime_error("neither a PNG nor a JPEG");
}

Image shrink(const Image& image, std::uint32_t size) {
  const std::uint32_t longer = std::max(image.width, image.height);
  if (longer <= size) {
    return image;
  }
  const auto scaled = [&](std::uint32_t side) {
    return std::max<std::uint32_t>(
        1, static_cast<std::uint32_t>((std::uint64_t{side} * size + longer / 2) / longer));
  };
  Image small{.width = scaled(image.width), .height = scaled(image.height), .rgb = {}};
  small.rgb.reserve(std::size_t{3} * small.width * small.height);
  for (std::uint32_t y = 0; y < small.height; ++y) {
    const Range rows = range_of(y, image.height, small.height);
    for (std::uint32_t x = 0; x < small.width; ++x) {
      append_average(image, rows, range_of(x, image.width, small.width), small.rgb);
    }
  }
  return small;
}

Bytes encode(const Image& image) {
  const TurboHandle handle(tjInitCompress());
  unsigned char* data = nullptr;
  unsigned long size = 0;
  const int result =
      tjCompress2(handle.get(), image.rgb.data(), static_cast<int>(image.width), 0,
                  static_cast<int>(image.height), TJPF_RGB, &data, &size, TJSAMP_420, 90, 0);
  const std::unique_ptr<unsigned char, decltype(&tjFree)> owner(data, &tjFree);
  check(handle.get(), result);
  const auto* bytes = reinterpret_cast<const std::byte*>(data);
  return {bytes, bytes + size};
}
