// A block of items as a value, and as a node in a queue of published blocks.
#pragma once

#include <cstddef>
#include <cstdint>

#include "carpool/report.h"

namespace carpool {

// Block is a run of items of one stage and bin in memory that came from the pool. Whoever holds the
// value owns the memory, and gives it back to a BlockCache; there is no destructor, because blocks
// are plain and handed on millions of times a second.
struct Block {
  std::byte* data = nullptr;
  std::uint32_t items = 0;
  std::uint32_t stage = 0;
  std::uint32_t bin = 0;
  std::uint8_t level = 0;
  bool claimed = false;  // see Spill
};

// ReadyBlock is a published block. It lives in a block of its own from the pool.
struct ReadyBlock {
  Block block;
  FlushCause cause = FlushCause::full;
  bool partial = false;    // counted, because the memory formula counts on there being few
  bool offered = false;    // by its owner to whoever has no work
  std::uint32_t lane = 0;  // in the ReadyQueue
  ReadyBlock* newer = nullptr;
  ReadyBlock* older = nullptr;
};
static_assert(sizeof(ReadyBlock) <= 64, "a ReadyBlock must fit one cache line");

}  // namespace carpool
