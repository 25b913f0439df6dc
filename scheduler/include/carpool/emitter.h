// How kernels and sources hand on items: a write into a block that belongs to this worker alone.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "carpool/handles.h"
#include "carpool/item.h"

namespace carpool {
namespace detail {

// The block that one worker is filling for one (stage, bin). All null while it has none, which
// makes the first emit take the slow path without a test of its own.
struct OpenSlot {
  std::byte* write = nullptr;  // where the next item goes
  std::byte* end = nullptr;    // where the slow path is due: full, or much fuller than before
  std::byte* begin = nullptr;  // the block
  std::uint32_t level = 0;     // how far it has come; see Layout
};

[[noreturn]] void throw_bad_bin(std::uint32_t stage, std::uint32_t bin, std::uint32_t bins);
[[noreturn]] void throw_undeclared_edge(std::uint32_t from, std::uint32_t to);

}  // namespace detail

/// Emitter takes the items that a kernel or source produces.
///
/// Cost: a few nanoseconds per item; about fifty more when a block becomes full.
/// Thread safety: belongs to the call it was passed to. Do not keep it, and do not use it from a
/// nested parallel_for: collect there, emit after. Errors: throws std::out_of_range for a bin the
/// stage does not have, and OverflowError when the run would leave its memory bound (see
/// RunOptions::overflow). Never blocks.
class Emitter {
 public:
  Emitter(const Emitter&) = delete;
  Emitter& operator=(const Emitter&) = delete;

  /// emit hands one item to bin `bin` of `stage`.
  template <Item T>
  void emit(StageHandle<T> stage, std::uint32_t bin, const T& item) {
    detail::OpenSlot& slot = slot_of(stage, bin);
    if (slot.write == slot.end) [[unlikely]] {
      make_room(stage.index_, bin);
    }
    std::memcpy(slot.write, &item, sizeof(T));
    slot.write += sizeof(T);
    tally_ += tally_of_[stage.index_];
  }

  /// emit hands several items to one bin: cheaper than one by one, from about four items on.
  template <Item T>
  void emit(StageHandle<T> stage, std::uint32_t bin, std::span<const T> items) {
    detail::OpenSlot& slot = slot_of(stage, bin);
    while (!items.empty()) {
      if (slot.write == slot.end) {
        make_room(stage.index_, bin);
      }
      const std::size_t room = static_cast<std::size_t>(slot.end - slot.write) / sizeof(T);
      const std::size_t count = std::min(room, items.size());
      std::memcpy(slot.write, items.data(), count * sizeof(T));
      slot.write += count * sizeof(T);
      tally_ += tally_of_[stage.index_] * count;
      items = items.subspan(count);
    }
  }

  /// emit, for callers whose span is of non-const items.
  template <Item T>
  void emit(StageHandle<T> stage, std::uint32_t bin, std::span<T> items) {
    emit(stage, bin, std::span<const T>(items));
  }

 protected:
  Emitter() = default;
  ~Emitter() = default;

  // Leaves slot.write != slot.end for that (stage, bin), or throws.
  virtual void make_room(std::uint32_t stage, std::uint32_t bin) = 0;

  detail::OpenSlot* slots_ = nullptr;        // by first_slot + bin
  const std::uint64_t* tally_of_ = nullptr;  // by stage: what one emit adds to
  const std::uint8_t* allowed_ = nullptr;  // by stage: declared edge from who emits? null: no check
  std::uint64_t tally_ = 0;                // of what was emitted; see Layout
  std::uint32_t emitting_ = 0;             // who emits, for the message

 private:
  template <class T>
  detail::OpenSlot& slot_of(StageHandle<T> stage, std::uint32_t bin) {
    if (bin >= stage.bins_) [[unlikely]] {
      detail::throw_bad_bin(stage.index_, bin, stage.bins_);
    }
#ifndef NDEBUG
    if (allowed_ != nullptr && allowed_[stage.index_] == 0) {
      detail::throw_undeclared_edge(emitting_, stage.index_);
    }
#endif
    return slots_[stage.first_slot_ + bin];
  }
};

}  // namespace carpool
