// How kernels and sources hand on items: a write into a block that belongs to this worker alone.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

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

// A part of a sum that is not in memory yet, also when an exception comes.
struct TallyPart {
  std::uint64_t& total;
  std::uint64_t sum = 0;
  void add_up() { total += std::exchange(sum, 0); }
  ~TallyPart() { add_up(); }
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

  /// emit_each hands on many items, each to where `to(item)` says: a std::pair of a stage's handle
  /// and a bin. Cheaper than one by one, the more so where a kernel first computes all of its
  /// items in one loop and then hands them on: between items, a branch that depends on the outcome
  /// of one keeps the processor from beginning with the next.
  template <Item T, class To>
  void emit_each(std::span<const T> items, const To& to) {
    // Copies, because to the compiler every item that is written could change the members.
    detail::OpenSlot* const slots = slots_;
    const std::uint64_t* const tally_of = tally_of_;
    detail::TallyPart part{tally_};
    for (const T& item : items) {
      const auto& [stage, bin] = to(item);
      if (bin < stage.bins_ && may_emit_to(stage.index_)) [[likely]] {
        detail::OpenSlot& slot = slots[stage.first_slot_ + bin];
        std::byte* const write = slot.write;
        if (write != slot.end) [[likely]] {
          std::memcpy(write, &item, sizeof(T));
          slot.write = write + sizeof(T);
          part.sum += tally_of[stage.index_];
          continue;
        }
      }
      part.add_up();  // what becomes full is published with its credits
      emit(stage, bin, item);
    }
  }

  /// emit_each, for callers whose span is of non-const items.
  template <Item T, class To>
  void emit_each(std::span<T> items, const To& to) {
    emit_each(std::span<const T>(items), to);
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
    if (!may_emit_to(stage.index_)) {
      detail::throw_undeclared_edge(emitting_, stage.index_);
    }
    return slots_[stage.first_slot_ + bin];
  }

  // Whether the edge is declared, if the node that emits has declared any. Debug builds check.
  bool may_emit_to([[maybe_unused]] std::uint32_t stage) const {
#ifndef NDEBUG
    return allowed_ == nullptr || allowed_[stage] != 0;
#else
    return true;
#endif
  }
};

}  // namespace carpool
