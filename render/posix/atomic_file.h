// Replaces files so that at every moment the old or the new contents are there in full.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace carpool::render {

/// Writes a temporary file beside `path`, syncs it and renames it over `path`. A symbolic link is
/// followed; a device or pipe is written to directly. Throws OutputError; then `path` is as it was
/// before.
void WriteFileAtomically(const std::filesystem::path& path, std::span<const std::byte> contents);

/// Throws OutputError if WriteFileAtomically(path) could not work: to be called before long
/// renders.
void CheckWritable(const std::filesystem::path& path);

}  // namespace carpool::render
