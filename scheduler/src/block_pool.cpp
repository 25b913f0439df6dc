// The slow paths of the block pool.
#include "block_pool.h"

#include <algorithm>
#include <mutex>
#include <string>

#include "carpool/errors.h"

namespace carpool {

BlockPool::BlockPool(const Layout& layout, Overflow overflow)
    : layout_(layout), overflow_(overflow), classes_(layout.classes.size()) {}

std::uint32_t BlockPool::take(std::uint32_t pool_class, std::uint32_t wanted, FreeBlock*& list) {
  Class& c = classes_[pool_class];
  const std::lock_guard guard(c.lock);
  if (c.free == nullptr) {
    add_slab(pool_class, c, wanted);
  }
  std::uint32_t taken = 0;
  while (taken < std::max(1U, wanted) && c.free != nullptr) {
    FreeBlock* block = c.free;
    c.free = block->next;
    block->next = list;
    list = block;
    ++taken;
  }
  return taken;
}

void BlockPool::give(std::uint32_t pool_class, FreeBlock* first, FreeBlock* last) {
  Class& c = classes_[pool_class];
  const std::lock_guard guard(c.lock);
  last->next = c.free;
  c.free = first;
}

void BlockPool::add_slab(std::uint32_t pool_class, Class& c, std::uint32_t wanted) {
  const PoolClass& limits = layout_.classes[pool_class];
  const std::uint64_t bytes = limits.bytes;
  // Grow by a half each time, so that a long run allocates rarely and a short one little.
  std::uint64_t count = std::clamp<std::uint64_t>(c.made / 2, wanted,
                                                  std::max<std::uint64_t>(wanted, 262144 / bytes));
  count = std::max<std::uint64_t>(count, 1);
  if (c.made + count > limits.limit) {
    if (c.made < limits.limit) {
      count = limits.limit - c.made;
    } else if (overflow_ != Overflow::grow) {
      throw OverflowError(
          "carpool: a kernel made more live items than its source's fan_out (or its stage's "
          "weight) "
          "declares: the run has used all " +
          std::to_string(limits.limit) + " blocks of " + std::to_string(bytes) +
          " bytes that worst_case_bytes() counts. Declare the true fan-out, or "
          "choose Overflow::spill or grow");
    } else {
      overflowed_.fetch_add(count, std::memory_order_relaxed);  // a statistic
    }
  }
  Slab slab(new (std::align_val_t{64}) std::byte[count * bytes]);
  for (std::uint64_t i = count; i-- > 0;) {
    c.free = ::new (slab.get() + i * bytes) FreeBlock{c.free};
  }
  c.slabs.push_back(std::move(slab));
  c.made += count;
  allocated_.fetch_add(count * bytes, std::memory_order_relaxed);  // a statistic
}

void BlockCache::give_half(std::uint32_t pool_class, Shelf& shelf) {
  const std::uint32_t count = shelf.count / 2;
  BlockPool::FreeBlock* first = shelf.free;
  BlockPool::FreeBlock* last = first;
  for (std::uint32_t i = 1; i < count; ++i) {
    last = last->next;
  }
  shelf.free = last->next;
  shelf.count -= count;
  pool_.give(pool_class, first, last);
}

}  // namespace carpool
