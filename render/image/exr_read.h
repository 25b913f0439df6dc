// Reads multi-channel EXR images back: for merge, compare and the tests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "render/image/exr_types.h"

namespace carpool::render {

struct ExrChannel {
  std::string name;
  std::variant<std::vector<float>, std::vector<uint32_t>> plane;  // rows from the top
};

struct ExrImage {
  int width = 0;
  int height = 0;
  std::vector<ExrChannel> channels;  // sorted by name
  ExrAttributes attributes;          // all string, float and int attributes that are not reserved

  /// The plane of a float channel, or null if there is no such channel.
  const std::vector<float>* FindFloats(const std::string& name) const;
  /// The plane of an unsigned channel, or null.
  const std::vector<uint32_t>* FindIds(const std::string& name) const;
};

/// Reads the first part, scan lines or the full-size level of tiles; half becomes float; subsampled
/// channels are refused. Throws InputError for anything that cannot be read in full.
ExrImage ReadExr(const std::filesystem::path& path);

/// The same for a file in memory; `where` names it in errors.
ExrImage DecodeExr(std::span<const std::byte> bytes, const std::string& where);

}  // namespace carpool::render
