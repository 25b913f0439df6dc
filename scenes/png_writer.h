// PNG without compression, so that the generator needs no library.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace carpool::scenes {

/// EncodePng() returns a PNG of 8-bit RGB texels, rows from the top.
std::string EncodePng(int width, int height, const std::vector<uint8_t>& rgb);

}  // namespace carpool::scenes
