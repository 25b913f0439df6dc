// Where blocks come from and go back to: no allocation once a run has warmed up, and never above
// its limit.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <vector>

#include "layout.h"
#include "spin_lock.h"

namespace carpool {

// BlockPool holds the memory of all blocks of a run.
//
// Properties and assumptions: thread-safe; one lock per size, taken once per several blocks because
// workers keep caches; memory goes back to the system when the pool dies; free blocks are chained
// through their own first bytes.
class BlockPool {
 public:
  BlockPool(const Layout& layout, Overflow overflow);

  std::size_t allocated_bytes() const { return allocated_.load(std::memory_order_relaxed); }
  std::uint64_t overflow_blocks() const { return overflowed_.load(std::memory_order_relaxed); }

 private:
  friend class BlockCache;

  struct FreeBlock {
    FreeBlock* next;
  };
  struct AlignedDelete {
    void operator()(std::byte* memory) const { ::operator delete[](memory, std::align_val_t{64}); }
  };
  using Slab = std::unique_ptr<std::byte[], AlignedDelete>;

  struct alignas(64) Class {
    SpinLock lock;
    FreeBlock* free = nullptr;
    std::uint64_t made = 0;  // blocks handed out of slabs so far
    std::vector<Slab> slabs;
  };

  // take moves up to `wanted` blocks to the front of `list` and returns how many; at least one, or
  // it throws.
  std::uint32_t take(std::uint32_t pool_class, std::uint32_t wanted, FreeBlock*& list);
  void give(std::uint32_t pool_class, FreeBlock* first, FreeBlock* last);
  void add_slab(std::uint32_t pool_class, Class& c, std::uint32_t wanted);

  const Layout& layout_;
  Overflow overflow_;
  std::vector<Class> classes_;
  std::atomic<std::size_t> allocated_{0};
  std::atomic<std::uint64_t> overflowed_{0};
};

// BlockCache is one worker's share of the pool. Not thread-safe.
class BlockCache {
 public:
  BlockCache(BlockPool& pool, const Layout& layout)
      : pool_(pool), layout_(layout), shelves_(layout.classes.size()) {}

  std::byte* allocate(std::uint32_t pool_class) {
    Shelf& shelf = shelves_[pool_class];
    if (shelf.free == nullptr) {
      shelf.count = pool_.take(pool_class, layout_.classes[pool_class].cache / 2, shelf.free);
    }
    BlockPool::FreeBlock* block = shelf.free;
    shelf.free = block->next;
    --shelf.count;
    return reinterpret_cast<std::byte*>(block);
  }

  void release(std::uint32_t pool_class, std::byte* memory) {
    Shelf& shelf = shelves_[pool_class];
    auto* block = ::new (memory) BlockPool::FreeBlock{shelf.free};
    shelf.free = block;
    if (++shelf.count > layout_.classes[pool_class].cache) {
      give_half(pool_class, shelf);
    }
  }

 private:
  struct Shelf {
    BlockPool::FreeBlock* free = nullptr;
    std::uint32_t count = 0;
  };
  void give_half(std::uint32_t pool_class, Shelf& shelf);

  BlockPool& pool_;
  const Layout& layout_;
  std::vector<Shelf> shelves_;
};

}  // namespace carpool
