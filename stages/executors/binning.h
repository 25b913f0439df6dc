// Which queue of the shading stage a hit belongs to: material x bounce depth, coarsened where bins
// could not fill.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include "stages/tables/path.h"

namespace carpool::stages {

/// Bins are worth having while each can hold a few full blocks of what is in flight; past that,
/// depths are merged first (neighbouring depths run the same code on the same textures), then
/// materials.
class ShadeBins {
 public:
  ShadeBins(uint32_t materials, uint32_t max_depth, uint64_t in_flight, uint32_t block_items) {
    const uint64_t room =
        std::max<uint64_t>(1, in_flight / (uint64_t{block_items} * kBlocksPerBin));
    materials_ = std::max<uint32_t>(1, materials);
    groups_ = static_cast<uint32_t>(std::min<uint64_t>(materials_, room));
    depths_ = static_cast<uint32_t>(
        std::clamp<uint64_t>(room / groups_, 1, std::min(max_depth + 1, kMaxDepthBins)));
    wanted_depths_ = std::min(max_depth + 1, kMaxDepthBins);
  }

  uint32_t count() const { return groups_ * depths_; }

  uint32_t Of(int32_t material, uint32_t flags) const {
    const uint32_t depth = std::min(flags & kPathDepthMask, depths_ - 1);
    const uint32_t group = groups_ == materials_
                               ? static_cast<uint32_t>(material)
                               : static_cast<uint32_t>(uint64_t{static_cast<uint32_t>(material)} *
                                                       groups_ / materials_);
    return group * depths_ + depth;
  }

  /// One line for the report; empty where nothing was merged.
  std::string Note() const {
    if (groups_ == materials_ && depths_ == wanted_depths_) return {};
    return std::to_string(materials_) + " materials x " + std::to_string(wanted_depths_) +
           " depths coarsened to " + std::to_string(groups_) + " x " + std::to_string(depths_) +
           " bins, so that paths in flight can fill them";
  }

 private:
  static constexpr uint32_t kBlocksPerBin = 2;
  static constexpr uint32_t kMaxDepthBins = 4;  // 0, 1, 2, deeper
  uint32_t materials_ = 1, groups_ = 1, depths_ = 1, wanted_depths_ = 1;
};

}  // namespace carpool::stages
