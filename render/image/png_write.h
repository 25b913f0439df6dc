// Writes 8-bit sRGB PNG pictures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

namespace carpool::render {

/// `rgb` has 3 bytes a pixel, sRGB-encoded, rows from the top. Atomic (see atomic_file.h). Throws
/// OutputError if the file cannot be written and std::invalid_argument for the wrong number of
/// bytes.
void WritePng(const std::filesystem::path& path, int width, int height,
              std::span<const uint8_t> rgb);

}  // namespace carpool::render
