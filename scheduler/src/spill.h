// Blocks that do not fit the memory bound, in a file.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <vector>

#include "block.h"
#include "block_pool.h"
#include "layout.h"
#include "posix/temporary_file.h"

namespace carpool {

// Spill sees to it that no more full blocks are in memory than the formula counts: each must claim
// its place when it leaves the worker that filled it, until it has been run; those that get none
// are written to a file. Open and partial blocks need no claim: there are as many as there are
// bins.
//
// The file is a stack of blocks, each with a trailer behind it, so that it needs no index: the
// memory it takes does not depend on how much is in it. What was written last is read first, which
// keeps the file short, and the system's cache of it warm.
//
// Blocks in the file lie with nobody. A worker does not leave before it has tried to read one back,
// and fails only while others hold all claims: workers, who will try in their turn, or threads of
// blocking stages, who send a worker (Exchange).
//
// Thread-safe: one mutex, taken when something is written or read.
class Spill {
 public:
  Spill(const Layout& layout, const std::filesystem::path& folder);

  // claim makes `block` one of those that the formula counts, or writes it to the file. In that
  // case its memory is the caller's to reuse. Throws std::system_error.
  bool claim(Block& block, FlushCause cause);

  // release gives a claim back.
  void release(const Block& block) { add(claims_of(block), -1); }

  // read_back takes a block out of the file, if it gets a claim; the memory comes from `cache`.
  bool read_back(BlockCache& cache, Block& block, FlushCause& cause);

  // How many blocks are in the file; how many were written; how long the file was at most. items is
  // for after the run.
  std::uint64_t blocks() const { return blocks_.load(std::memory_order_relaxed); }
  std::uint64_t written() const { return written_; }
  std::uint64_t peak_bytes() const { return peak_; }
  std::uint64_t items() const { return items_; }

 private:
  struct Trailer {
    std::uint32_t stage = 0;
    std::uint32_t bin = 0;
    std::uint32_t items = 0;
    FlushCause cause = FlushCause::full;
  };
  struct alignas(64) Claims {
    std::atomic<std::int64_t> left{0};
  };

  Claims& claims_of(const Block& block) {
    return claims_[layout_.stages[block.stage].levels[block.level].pool_class];
  }
  static void add(Claims& claims, std::int64_t count) {
    claims.left.fetch_sub(count, std::memory_order_relaxed);
  }
  bool try_claim(Claims& claims);
  void write(const Block& block, FlushCause cause);
  std::uint64_t bytes_of(const Trailer& trailer) const {
    return std::uint64_t{layout_.stages[trailer.stage].item_bytes} * trailer.items;
  }

  const Layout& layout_;
  std::vector<Claims> claims_;  // by pool class
  std::atomic<std::uint64_t> blocks_{0};
  std::mutex mutex_;  // guards what follows
  TemporaryFile file_;
  Trailer top_;  // of the topmost block
  std::uint64_t end_ = 0;
  std::uint64_t written_ = 0;
  std::uint64_t items_ = 0;
  std::uint64_t peak_ = 0;
};

}  // namespace carpool
