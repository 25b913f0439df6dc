// Reads lat-long environment maps from Radiance (.hdr) and OpenEXR (.exr) files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "render/base/error.h"

namespace carpool::render {

constexpr int64_t kMaxEnvironmentPixels = int64_t{1} << 27;  // 16384 x 8192

/// Linear Rec.709 radiance in the file's units, rows from the top, 3 floats a texel, all finite and
/// >= 0.
struct EnvironmentMap {
  int width = 0;
  int height = 0;
  std::vector<float> rgb;
  int64_t rejected_texels =
      0;  // had a NaN or infinite channel (now all 0) or a negative one (now 0)
  int64_t clamped_texels = 0;  // lay outside Rec.709 after conversion of primaries: channel now 0
};

/// The format is told by the contents. Channels R, G, B, or Y for grey, are read, others ignored;
/// sensible primaries that the file names are converted to Rec.709; Radiance's EXPOSURE is divided
/// out. Rejected and clamped texels are counted and warned of. Throws InputError for anything that
/// cannot be read in full.
EnvironmentMap ReadEnvironment(const std::filesystem::path& path, const WarningSink& warn);

/// The same for a file in memory; `where` names it in errors and warnings.
EnvironmentMap DecodeEnvironment(std::span<const std::byte> bytes, const std::string& where,
                                 const WarningSink& warn);

}  // namespace carpool::render
