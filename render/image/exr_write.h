// Writes multi-channel EXR images: the renderer's main output.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <variant>

#include "render/image/exr_types.h"

namespace carpool::render {

/// One channel, rows from the top, width x height values. Layers are named with dots: "albedo.R".
struct ExrChannelView {
  std::string name;
  std::variant<std::span<const float>, std::span<const uint32_t>> plane;
};

/// Writes a ZIP-compressed scan-line file with Rec.709 chromaticities, atomically (see
/// atomic_file.h). The same arguments give the same bytes. Throws OutputError if the file cannot be
/// written, and std::invalid_argument for a plane of the wrong size, a channel given twice or a
/// reserved attribute name.
void WriteExr(const std::filesystem::path& path, int width, int height,
              std::span<const ExrChannelView> channels, const ExrAttributes& attributes);

}  // namespace carpool::render
