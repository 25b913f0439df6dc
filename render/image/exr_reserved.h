// The attribute names that the EXR format keeps for itself. Internal to render/image.
#pragma once

#include <algorithm>
#include <array>
#include <string_view>

namespace carpool::render {

/// OpenEXR expects its own types under these names; we neither write nor report them as attributes.
inline bool IsReservedExrAttribute(std::string_view name) {
  constexpr std::array<std::string_view, 18> kReserved = {"channels",
                                                          "chromaticities",
                                                          "chunkCount",
                                                          "compression",
                                                          "dataWindow",
                                                          "displayWindow",
                                                          "dwaCompressionLevel",
                                                          "lineOrder",
                                                          "maxSamplesPerPixel",
                                                          "multiView",
                                                          "name",
                                                          "pixelAspectRatio",
                                                          "preview",
                                                          "screenWindowCenter",
                                                          "screenWindowWidth",
                                                          "tiles",
                                                          "type",
                                                          "version"};
  return std::ranges::find(kReserved, name) != kReserved.end();
}

}  // namespace carpool::render
