// Memory for tables that are visited in no order: in huge pages where the system has them.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <new>
#include <type_traits>
#include <vector>

namespace carpool::stages {

/// An allocator whose larger blocks begin at a huge page and ask for huge pages: a look-up in a
/// table of many small pages waits for the page's address first. Where the system has none to give,
/// the memory is as any other.
template <class T>
struct HugePageAllocator {
  using value_type = T;
  static constexpr std::size_t kHugePage = std::size_t{2} << 20;

  HugePageAllocator() = default;
  template <class U>
  HugePageAllocator(const HugePageAllocator<U>&) {}

  T* allocate(std::size_t count) {
    if (count > (static_cast<std::size_t>(-1) - kHugePage) / sizeof(T)) throw std::bad_alloc();
    const bool large = count * sizeof(T) >= kHugePage;
    const std::size_t unit = large ? kHugePage : 128;
    const std::size_t bytes = (count * sizeof(T) + unit - 1) / unit * unit;
    void* const memory = std::aligned_alloc(unit, bytes);
    if (memory == nullptr) throw std::bad_alloc();
    if (large) madvise(memory, bytes, MADV_HUGEPAGE);  // advice: nothing depends on it
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t) { std::free(memory); }

  friend bool operator==(const HugePageAllocator&, const HugePageAllocator&) { return true; }
};

template <class T>
using HugeVector = std::vector<T, HugePageAllocator<T>>;

/// The same for what is filled anyway: resize() leaves what it adds unset, so that a page is first
/// touched, which makes the system clear it, by the thread that fills it.
template <class T>
struct UnsetHugePageAllocator : HugePageAllocator<T> {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_default_constructible_v<T>);
  template <class U>
  struct rebind {
    using other = UnsetHugePageAllocator<U>;
  };

  void construct(T*) {}
  void construct(T* at, const T& value) { *at = value; }
};

template <class T>
using UnsetHugeVector = std::vector<T, UnsetHugePageAllocator<T>>;

}  // namespace carpool::stages
