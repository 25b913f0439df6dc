// Claims on memory, and the stack of blocks in the file.
#include "spill.h"

#include <algorithm>
#include <span>

namespace carpool {

Spill::Spill(const Layout& layout, const std::filesystem::path& folder)
    : layout_(layout),
      claims_(layout.classes.size()),
      file_(folder.empty() ? std::filesystem::temp_directory_path() : folder) {
  for (std::size_t c = 0; c < claims_.size(); ++c) {
    claims_[c].left = static_cast<std::int64_t>(layout.classes[c].full);
  }
}

// Relaxed: a claim is a number; the block itself is handed on by queues and locks.
bool Spill::try_claim(Claims& claims) {
  std::int64_t left = claims.left.load(std::memory_order_relaxed);
  while (left > 0 &&
         !claims.left.compare_exchange_weak(left, left - 1, std::memory_order_relaxed)) {
  }
  return left > 0;
}

bool Spill::claim(Block& block, FlushCause cause) {
  if (try_claim(claims_of(block))) {
    block.claimed = true;
    return true;
  }
  write(block, cause);
  return false;
}

void Spill::write(const Block& block, FlushCause cause) {
  const Trailer trailer{
      .stage = block.stage, .bin = block.bin, .items = block.items, .cause = cause};
  const std::lock_guard guard(mutex_);
  const std::uint64_t bytes = bytes_of(trailer);
  file_.write(end_, {block.data, bytes});
  file_.write(end_ + bytes, std::as_bytes(std::span(&trailer, 1)));
  end_ += bytes + sizeof trailer;
  top_ = trailer;
  ++written_;
  items_ += block.items;
  peak_ = std::max(peak_, end_);
  blocks_.fetch_add(1, std::memory_order_relaxed);
}

bool Spill::read_back(BlockCache& cache, Block& block, FlushCause& cause) {
  if (blocks() == 0) {
    return false;
  }
  const std::lock_guard guard(mutex_);
  if (blocks() == 0) {
    return false;
  }
  const StageLayout& stage = layout_.stages[top_.stage];
  block = {.items = top_.items, .stage = top_.stage, .bin = top_.bin, .level = stage.top_level};
  cause = top_.cause;
  if (!try_claim(claims_of(block))) {
    return false;
  }
  block.claimed = true;
  block.data = cache.allocate(stage.levels[stage.top_level].pool_class);
  const std::uint64_t bytes = bytes_of(top_);
  end_ -= bytes + sizeof(Trailer);
  file_.read(end_, {block.data, bytes});
  if (end_ != 0) {
    file_.read(end_ - sizeof(Trailer), std::as_writable_bytes(std::span(&top_, 1)));
  }
  items_ -= block.items;
  blocks_.fetch_sub(1, std::memory_order_relaxed);
  return true;
}

}  // namespace carpool
