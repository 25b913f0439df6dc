// Which camera packets a pass renders, in which order: tiles of 16x16 pixels, samples, groups of
// 4x2.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

namespace carpool::stages {

constexpr uint32_t kGroupWidth = 4, kGroupHeight = 2;  // pixels of one coherent packet
constexpr uint32_t kTileSize = 16;                     // pixels along a tile's side
constexpr uint32_t kGroupsPerTile = kTileSize * kTileSize / 8;
constexpr uint32_t kClaim =
    4 * kGroupsPerTile;           // packets that a worker claims at once: some samples of a tile
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

/// The phase of the group whose first pixel is (x, y), by its place among the 4 x 8 groups of its
/// tile. The coordinates' bits are interleaved in reverse, so that the first 2^k phases are always
/// an even grid.
inline uint32_t PhaseOf(uint32_t x, uint32_t y) {
  const uint32_t column = x / kGroupWidth, row = y / kGroupHeight;
  return (row & 1) << 4 | (column & 1) << 3 | (row & 2) << 1 | (column & 2) | (row & 4) >> 2;
}

/// Hands out the packets of a pass, each once. Each worker has a range of tiles for its own, and
/// keeps to a tile until that has no samples left: the tile's pixels, which are visited once a
/// sample, stay in one cache, and no other core fetches their neighbours ahead. Who is through
/// takes tiles from the ends of others' ranges, and last helps with the tiles that others are in.
/// Thread safe and lock free, as long as each worker index is used by one thread at a time.
class CameraWork {
 public:
  CameraWork(uint32_t width, uint32_t height, const CameraPass& pass, uint32_t workers = 1)
      : width_(width),
        height_(height),
        pass_(pass),
        tiles_x_((width + kTileSize - 1) / kTileSize),
        per_tile_(uint64_t{pass.sample_count} * kGroupsPerTile),
        workers_(workers) {
    const uint64_t tiles = uint64_t{tiles_x_} * ((height + kTileSize - 1) / kTileSize);
    end_ = tiles * per_tile_;
    if (end_ == 0) return;  // and no worker has tiles
    for (uint64_t w = 0; w < workers; ++w) {
      workers_[w].fresh = Tiles{static_cast<uint32_t>(tiles * w / workers),
                                static_cast<uint32_t>(tiles * (w + 1) / workers)};
    }
  }

  /// Claims `count` places, or what is left, and calls `visit(packet)` for those inside the image
  /// and the phases. False when nothing is left.
  template <class Visit>
  bool Claim(uint32_t worker, uint32_t count, Visit visit) {
    for (uint64_t left = count; left > 0;) {
      const Places places = Take(worker, left);
      if (places.empty()) break;
      left -= places.last - places.first;
      claimed_.fetch_add(places.last - places.first, std::memory_order_relaxed);
      for (uint64_t i = places.first; i < places.last; ++i) {
        const CameraPacket packet = At(i);
        if (packet.x < width_ && packet.y < height_ &&
            ((pass_.phases >> PhaseOf(packet.x, packet.y)) & 1u) != 0) {
          visit(packet);
        }
      }
    }
    return claimed_.load(std::memory_order_relaxed) < end_;
  }

  /// Places handed out so far over all places, 0..1.
  double Fraction() const {
    const uint64_t done = claimed_.load(std::memory_order_relaxed);
    return end_ == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(end_);
  }

 private:
  struct Places {
    uint64_t first, last;
    bool empty() const { return first == last; }
  };
  struct alignas(8) Tiles {
    uint32_t first, last;
  };
  struct alignas(128) Worker {
    std::atomic<uint64_t> next{0};  // place in the tile that it is in; at a tile's begin: in none
    std::atomic<Tiles> fresh{Tiles{0, 0}};
  };

  /// Up to `count` places of one tile; none if there are none.
  Places Take(uint32_t worker, uint64_t count) {
    Places places = Continue(workers_[worker], count);
    for (uint32_t i = 0; places.empty() && i < workers_.size(); ++i)
      places = Begin(worker, i, count);
    for (uint32_t i = 1; places.empty() && i < workers_.size(); ++i)
      places = Continue(workers_[(worker + i) % workers_.size()], count);
    return places;
  }

  /// From the tile that a worker is in. Places are never handed out again, so no value of `next`
  /// comes twice.
  Places Continue(Worker& in, uint64_t count) {
    uint64_t first = in.next.load(std::memory_order_relaxed), last;
    do {
      if (per_tile_ == 0 || first % per_tile_ == 0) return {0, 0};
      last = first + std::min(count, per_tile_ - first % per_tile_);
    } while (!in.next.compare_exchange_weak(first, last, std::memory_order_relaxed));
    return {first, last};
  }

  /// From a fresh tile on, which becomes the worker's: the first of its own, the last of another's.
  Places Begin(uint32_t worker, uint32_t distance, uint64_t count) {
    std::atomic<Tiles>& fresh = workers_[(worker + distance) % workers_.size()].fresh;
    Tiles tiles = fresh.load(std::memory_order_relaxed), rest;
    do {
      if (tiles.first == tiles.last) return {0, 0};
      rest =
          distance == 0 ? Tiles{tiles.first + 1, tiles.last} : Tiles{tiles.first, tiles.last - 1};
    } while (!fresh.compare_exchange_weak(tiles, rest, std::memory_order_relaxed));
    const uint64_t first = per_tile_ * (distance == 0 ? tiles.first : rest.last);
    const uint64_t last = first + std::min(count, per_tile_);
    workers_[worker].next.store(last, std::memory_order_relaxed);
    return {first, last};
  }

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
  uint32_t tiles_x_;
  uint64_t per_tile_, end_;
  std::vector<Worker> workers_;
  std::atomic<uint64_t> claimed_{0};
};

}  // namespace carpool::stages
