// Which batch next: the order in which a worker takes the blocks that are ready.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace carpool {

/// BlockInfo is what a policy may know about a block of items.
struct BlockInfo {
  std::uint32_t stage = 0;  ///< StageHandle::index()
  std::uint32_t bin = 0;
  std::uint32_t items = 0;     ///< How many it holds now.
  std::uint32_t capacity = 0;  ///< The stage's block_items.
  int rank = 0;                ///< The stage's rank.
};

/// Policy orders blocks. Full blocks come before partial ones, and it decides among each; except
/// where bins are in order, which full and partial blocks keep alike.
///
/// A policy is a preference of each worker among the blocks it has, not a promise about the whole
/// run: other workers take what they have at the same time.
class Policy {
 public:
  enum class Kind { deepest_first, fullest_first, oldest_first, bins_in_order, custom };

  /// Chooses a lane for a block: lane 0 is taken first. Called once when a block is published, and
  /// for up to 16 candidates when a worker has only partial blocks left. Called from all workers at
  /// once.
  using LaneFunction = std::function<std::uint32_t(const BlockInfo&)>;

  /// deepest_first takes the highest rank first, which drains memory. Newest first among equals: it
  /// is still in cache.
  static Policy deepest_first();

  /// fullest_first takes the longest batches first, which gives the best run length.
  static Policy fullest_first();

  /// oldest_first takes blocks in the order in which they were opened, which is the fairest.
  static Policy oldest_first();

  /// bins_in_order takes the lowest bin first, of whatever stage, even if its block is not full and
  /// others are: for algorithms that do much more work when they run ahead, such as
  /// label-correcting searches. Batches become shorter for it.
  static Policy bins_in_order();

  /// bins_in_ring does the same on a ring of bins, as many as the stage with the most has: for a
  /// sequence without end. A worker that took bin b last takes first what is up to half a ring
  /// before b, then b, then what is behind it.
  static Policy bins_in_ring();

  /// custom takes blocks by your own lane function; the oldest first within a lane. `lanes` is at
  /// most 65,536.
  static Policy custom(std::string name, std::uint32_t lanes, LaneFunction lane_of);

  Kind kind() const { return kind_; }
  const std::string& name() const { return name_; }
  std::uint32_t lanes() const { return lanes_; }  ///< Of bins in order: 0, a lane per bin.
  bool ring() const { return ring_; }
  const LaneFunction& lane_function() const { return lane_of_; }

 private:
  Policy(Kind kind, std::string name, std::uint32_t lanes, LaneFunction lane_of);

  Kind kind_;
  std::string name_;
  std::uint32_t lanes_;
  LaneFunction lane_of_;
  bool ring_ = false;
};

}  // namespace carpool
