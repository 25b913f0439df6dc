// Replaces operator new by one that counts. In a file of its own, so that no compiler sees new and
// free in one function and suspects a mistake.
#include "allocations.h"

#include <atomic>
#include <cstdlib>
#include <new>

#include <malloc.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define CARPOOL_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define CARPOOL_SANITIZED 1
#endif
#endif

namespace {

// Relaxed throughout: statistics.
std::atomic<std::uint64_t> allocations{0};
std::atomic<std::size_t> live{0};
std::atomic<std::size_t> peak{0};

#ifndef CARPOOL_SANITIZED
void* counted(void* memory) {
  if (memory == nullptr) {
    throw std::bad_alloc();
  }
  allocations.fetch_add(1, std::memory_order_relaxed);
  const std::size_t bytes = malloc_usable_size(memory);
  const std::size_t now = live.fetch_add(bytes, std::memory_order_relaxed) + bytes;
  std::size_t most = peak.load(std::memory_order_relaxed);
  while (most < now && !peak.compare_exchange_weak(most, now, std::memory_order_relaxed)) {
  }
  return memory;
}

void release(void* memory) noexcept {
  live.fetch_sub(malloc_usable_size(memory), std::memory_order_relaxed);
  std::free(memory);
}
#endif

}  // namespace

#ifndef CARPOOL_SANITIZED
void* operator new(std::size_t size) {
  return counted(std::malloc(size));
}
void* operator new(std::size_t size, std::align_val_t align) {
  const auto alignment = static_cast<std::size_t>(align);
  return counted(std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment));
}
void operator delete(void* memory) noexcept {
  release(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  release(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  release(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  release(memory);
}
#endif

namespace carpool_test {

bool counts_allocations() {
#ifdef CARPOOL_SANITIZED
  return false;
#else
  return true;
#endif
}

std::uint64_t allocation_count() {
  return allocations.load();
}

std::size_t live_bytes() {
  return live.load();
}

std::size_t peak_live_bytes() {
  return peak.load();
}

void reset_peak_live_bytes() {
  peak.store(live.load());
}

}  // namespace carpool_test
