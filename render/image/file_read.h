// Reads a whole file into memory. Internal to render/image.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

namespace carpool::render {

/// Throws InputError if the file is missing, is no regular file or cannot be read.
std::vector<std::byte> ReadWholeFile(const std::filesystem::path& path);

}  // namespace carpool::render
