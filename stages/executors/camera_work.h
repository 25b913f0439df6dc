// Which camera packets a pass renders, in which order: tiles of 16x16 pixels, samples, groups of
// 4x2.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>

namespace carpool::stages {

constexpr uint32_t kGroupWidth = 4, kGroupHeight = 2;  // pixels of one coherent packet
constexpr uint32_t kTileSize = 16;                     // pixels along a tile's side
constexpr uint32_t kGroupsPerTile = kTileSize * kTileSize / 8;
constexpr uint32_t kClaim =
    4 * kGroupsPerTile;           // packets that a worker claims at once: four samples
                                  // of a tile, whose pixels stay in one cache
constexpr uint32_t kPhases = 32;  // interleaved subsets of groups, for previews
constexpr uint32_t kAllPhases = ~0u;

/// Samples [first_sample, first_sample + sample_count) of the groups whose phase is in `phases`
/// (bit p: phase p).
struct CameraPass {
  uint32_t first_sample = 0;
  uint32_t sample_count = 1;
  uint32_t phases = kAllPhases;
};

/// A fixed group of 4x2 pixels at one sample: what one packet traces. Groups on the border may
/// reach outside the image.
struct CameraPacket {
  uint32_t x, y;  // of its first pixel
  uint32_t sample;
};

/// Calls visit(lane, pixel) for the pixels (y * width + x) of a packet that are in the image.
template <class Visit>
void EachPixel(const CameraPacket& packet, uint32_t width, uint32_t height, const Visit& visit) {
  for (uint32_t i = 0; i < kGroupWidth * kGroupHeight; ++i) {
    const uint32_t x = packet.x + i % kGroupWidth, y = packet.y + i / kGroupWidth;
    if (x < width && y < height) visit(i, y * width + x);
  }
}

/// The phase of the group whose first pixel is (x, y), by its place among the 4 x 8 groups of its
/// tile. The coordinates' bits are interleaved in reverse, so that the first 2^k phases are always
/// an even grid.
inline uint32_t PhaseOf(uint32_t x, uint32_t y) {
  const uint32_t column = x / kGroupWidth, row = y / kGroupHeight;
  return (row & 1) << 4 | (column & 1) << 3 | (row & 2) << 1 | (column & 2) | (row & 4) >> 2;
}

/// Hands out the packets of a pass, each once. Thread safe and lock free.
class CameraWork {
 public:
  CameraWork(uint32_t width, uint32_t height, const CameraPass& pass)
      : width_(width), height_(height), pass_(pass), tiles_x_((width + kTileSize - 1) / kTileSize) {
    const uint64_t tiles_y = (height + kTileSize - 1) / kTileSize;
    end_ = tiles_x_ * tiles_y * pass.sample_count * kGroupsPerTile;
  }

  /// Claims up to `count` places and calls `visit(packet)` for those inside the image and the
  /// phases. False when nothing is left.
  template <class Visit>
  bool Claim(uint32_t count, Visit visit) {
    const uint64_t first = next_.fetch_add(count, std::memory_order_relaxed);
    const uint64_t last = std::min(first + count, end_);
    for (uint64_t i = first; i < last; ++i) {
      const CameraPacket packet = At(i);
      if (packet.x < width_ && packet.y < height_ &&
          ((pass_.phases >> PhaseOf(packet.x, packet.y)) & 1u) != 0) {
        visit(packet);
      }
    }
    return last < end_ && first < end_;
  }

  /// Places handed out so far over all places, 0..1.
  double Fraction() const {
    const uint64_t done = std::min(next_.load(std::memory_order_relaxed), end_);
    return end_ == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(end_);
  }

 private:
  CameraPacket At(uint64_t place) const {
    const uint32_t group = static_cast<uint32_t>(place % kGroupsPerTile);
    place /= kGroupsPerTile;
    const uint32_t sample = static_cast<uint32_t>(place % pass_.sample_count);
    const uint64_t tile = place / pass_.sample_count;
    constexpr uint32_t kAcross = kTileSize / kGroupWidth;
    return {static_cast<uint32_t>(tile % tiles_x_) * kTileSize + group % kAcross * kGroupWidth,
            static_cast<uint32_t>(tile / tiles_x_) * kTileSize + group / kAcross * kGroupHeight,
            pass_.first_sample + sample};
  }

  uint32_t width_, height_;
  CameraPass pass_;
  uint64_t tiles_x_;
  uint64_t end_;
  std::atomic<uint64_t> next_{0};
};

}  // namespace carpool::stages
