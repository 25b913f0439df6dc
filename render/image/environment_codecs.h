// What environment_read.cpp dispatches to. Internal to render/image.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "render/image/primaries.h"

namespace carpool::render {

/// Texels as the file has them: any float, in the file's primaries.
struct RawEnvironment {
  int width = 0;
  int height = 0;
  std::vector<float> rgb;
  Primaries primaries;
};

RawEnvironment ReadRgbe(std::span<const std::byte> bytes, const std::string& where);
RawEnvironment ReadExrEnvironment(std::span<const std::byte> bytes, const std::string& where);

/// Throws InputError if the size breaks the limits of image_decode.h or environment_read.h.
void CheckEnvironmentSize(int64_t width, int64_t height, const std::string& where);

}  // namespace carpool::render
