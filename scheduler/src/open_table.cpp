// Opening, growing and choosing open blocks.
#include "open_table.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <stdexcept>
#include <string>

namespace carpool {

namespace detail {

void throw_bad_bin(std::uint32_t stage, std::uint32_t bin, std::uint32_t bins) {
  throw std::out_of_range("carpool: emit to bin " + std::to_string(bin) + " of stage #" +
                          std::to_string(stage) + ", which has " + std::to_string(bins) +
                          (bins == 0 ? " (is the handle set?)" : ""));
}

void throw_undeclared_edge(std::uint32_t from, std::uint32_t to) {
  throw std::logic_error("carpool: node #" + std::to_string(from) + " emits to stage #" +
                         std::to_string(to) +
                         ", but has declared other edges only; add_edge() is missing");
}

}  // namespace detail

OpenTable::OpenTable(const Layout& layout, const Policy& policy, BlockCache& cache, BlockSink& sink)
    : layout_(layout), policy_(policy), cache_(cache), sink_(sink), table_(layout.slots) {
  grades_.fill(Bitmap(layout.slots));
  if (layout.track_age) {
    ages_.resize(layout.slots);
  }
  slots_ = table_.data();
}

void OpenTable::make_room(std::uint32_t stage_index, std::uint32_t bin) {
  const StageLayout& stage = layout_.stages[stage_index];
  detail::OpenSlot& slot = table_[stage.first_slot + bin];
  if (slot.begin == nullptr) {
    open(stage, bin);
  } else if (slot.level < stage.top_level) {
    go_up(stage, bin);
  } else {
    sink_.publish(remove(stage.first_bit + bin), stage.full_cause);
    open(stage, bin);
  }
}

void OpenTable::open(const StageLayout& stage, std::uint32_t bin) {
  const std::uint32_t index = stage.first_slot + bin;
  const BlockLevel& level = stage.levels[0];
  std::byte* data = cache_.allocate(level.pool_class);  // may throw: the slot is still empty then
  table_[index] = {.write = data,
                   .end = data + std::size_t{level.items} * stage.item_bytes,
                   .begin = data,
                   .level = 0};
  set_grade(level.grade, stage.first_bit + bin);
  count_.add(1);
  if (layout_.track_age) {
    link(index);
  }
}

void OpenTable::go_up(const StageLayout& stage, std::uint32_t bin) {
  detail::OpenSlot& slot = table_[stage.first_slot + bin];
  const BlockLevel& from = stage.levels[slot.level];
  const BlockLevel& to = stage.levels[slot.level + 1];
  if (from.pool_class != to.pool_class) {
    std::byte* data = cache_.allocate(to.pool_class);  // may throw: the slot is as it was then
    const std::size_t used = static_cast<std::size_t>(slot.write - slot.begin);
    std::memcpy(data, slot.begin, used);
    cache_.release(from.pool_class, slot.begin);
    slot.begin = data;
    slot.write = data + used;
  }
  if (from.grade != to.grade) {
    clear_grade(from.grade, stage.first_bit + bin);
    set_grade(to.grade, stage.first_bit + bin);
  }
  slot.end = slot.begin + std::size_t{to.items} * stage.item_bytes;
  ++slot.level;
}

Block OpenTable::remove(std::uint32_t bit) {
  const std::uint32_t stage_index = layout_.stage_of_bit[bit];
  const StageLayout& stage = layout_.stages[stage_index];
  const std::uint32_t bin = bit - stage.first_bit;
  const std::uint32_t index = stage.first_slot + bin;
  detail::OpenSlot& slot = table_[index];
  const Block block{.data = slot.begin,
                    .items = items_in(stage, slot),
                    .stage = stage_index,
                    .bin = bin,
                    .level = static_cast<std::uint8_t>(slot.level)};
  clear_grade(stage.levels[slot.level].grade, bit);
  slot = {};
  count_.set(count_.get() - 1);
  if (layout_.track_age) {
    unlink(index);
  }
  return block;
}

bool OpenTable::take_best(Block& block) {
  if (count() == 0) {
    return false;
  }
  block = remove(choose());
  return true;
}

bool OpenTable::take_fullest(std::uint32_t stage_index, Block& block) {
  const StageLayout& stage = layout_.stages[stage_index];
  for (std::uint32_t grades = grades_in_use_; grades != 0;) {
    const auto grade = static_cast<std::uint32_t>(std::bit_width(grades) - 1);
    grades &= ~(1U << grade);
    const std::uint32_t bit = grades_[grade].first_from(stage.first_bit);
    if (bit >= stage.first_bit && bit - stage.first_bit < stage.bins) {
      block = remove(bit);
      return true;
    }
  }
  return false;
}

void OpenTable::absorb(const Block& block) {
  const StageLayout& stage = layout_.stages[block.stage];
  detail::OpenSlot& slot = table_[stage.first_slot + block.bin];
  const std::byte* from = block.data;
  std::size_t left = std::size_t{block.items} * stage.item_bytes;
  while (left != 0) {
    if (slot.write == slot.end) {
      make_room(block.stage, block.bin);
    }
    const std::size_t part = std::min(left, static_cast<std::size_t>(slot.end - slot.write));
    std::memcpy(slot.write, from, part);
    slot.write += part;
    from += part;
    left -= part;
  }
}

std::uint32_t OpenTable::choose() {
  if (policy_.kind() == Policy::Kind::custom) {
    return choose_by_lane_function();
  }
  if (policy_.kind() == Policy::Kind::bins_in_order) {
    return nearest(first_bin_, layout_.lanes).bit;
  }
  if (policy_.kind() == Policy::Kind::oldest_first) {
    const std::uint32_t slot = oldest_;
    for (const StageLayout& stage : layout_.stages) {
      if (slot >= stage.first_slot && slot - stage.first_slot < stage.bins) {
        return stage.first_bit + (slot - stage.first_slot);
      }
    }
  }
  const Bitmap& fullest = grades_[static_cast<std::uint32_t>(std::bit_width(grades_in_use_) - 1)];
  // By turns: while a bin waits for its turn it becomes fuller.
  std::uint32_t bit = fullest.first_from(cursor_);
  if (policy_.kind() == Policy::Kind::deepest_first) {
    const std::uint32_t deepest = fullest.first();
    bit = layout_.stage_of_bit[bit] == layout_.stage_of_bit[deepest] ? bit : deepest;
  }
  cursor_ = bit + 1;
  return bit;
}

std::uint32_t OpenTable::choose_by_lane_function() {
  constexpr std::uint32_t kCandidates = 16;
  std::uint32_t best = Bitmap::kNone;
  std::uint32_t best_lane = ~0U;
  std::uint32_t seen = 0;
  for (const Bitmap& bits : grades_) {
    if (bits.empty()) {
      continue;
    }
    const std::uint32_t begin = bits.first_from(cursor_);
    std::uint32_t bit = begin;
    do {
      const std::uint32_t stage_index = layout_.stage_of_bit[bit];
      const StageLayout& stage = layout_.stages[stage_index];
      const std::uint32_t bin = bit - stage.first_bit;
      const detail::OpenSlot& slot = table_[stage.first_slot + bin];
      const std::uint32_t lane = policy_.lane_function()(
          {.stage = stage_index,
           .bin = bin,
           .items = static_cast<std::uint32_t>(slot.write - slot.begin) / stage.item_bytes,
           .capacity = stage.block_items,
           .rank = stage.rank});
      if (lane < best_lane || best == Bitmap::kNone) {
        best = bit;
        best_lane = lane;
      }
      bit = bits.first_from(bit + 1);
    } while (bit != begin && ++seen < kCandidates);
  }
  cursor_ = best + 1;
  return best;
}

OpenTable::Nearest OpenTable::nearest(std::uint32_t begin, std::uint32_t ring) const {
  Nearest best;
  if (count() == 0) {
    return best;
  }
  for (const StageLayout& stage : layout_.stages) {
    const auto has = [&](std::uint32_t bit) {
      return bit >= stage.first_bit && bit - stage.first_bit < stage.bins;
    };
    for (std::uint32_t grades = grades_in_use_; grades != 0; grades &= grades - 1) {
      const Bitmap& bits = grades_[static_cast<std::uint32_t>(std::countr_zero(grades))];
      std::uint32_t bit =
          begin < stage.bins ? bits.first_from(stage.first_bit + begin) : Bitmap::kNone;
      bit = has(bit) ? bit : bits.first_from(stage.first_bit);
      if (!has(bit)) {
        continue;
      }
      const std::uint32_t bin = bit - stage.first_bit;
      const std::uint32_t distance = bin >= begin ? bin - begin : bin + ring - begin;
      best = distance < best.distance ? Nearest{bit, distance} : best;
    }
  }
  return best;
}

bool OpenTable::take_older_than(std::uint64_t ticks, Block& block) {
  if (oldest_ == Bitmap::kNone || ages_[oldest_].opened >= ticks) {
    return false;
  }
  for (const StageLayout& stage : layout_.stages) {
    if (oldest_ >= stage.first_slot && oldest_ - stage.first_slot < stage.bins) {
      block = remove(stage.first_bit + (oldest_ - stage.first_slot));
      return true;
    }
  }
  return false;
}

void OpenTable::link(std::uint32_t slot) {
  ages_[slot] = {.older = newest_, .newer = Bitmap::kNone, .opened = now_};
  (newest_ != Bitmap::kNone ? ages_[newest_].newer : oldest_) = slot;
  newest_ = slot;
}

void OpenTable::unlink(std::uint32_t slot) {
  const AgeLink& age = ages_[slot];
  (age.older != Bitmap::kNone ? ages_[age.older].newer : oldest_) = age.newer;
  (age.newer != Bitmap::kNone ? ages_[age.newer].older : newest_) = age.older;
}

std::uint64_t OpenTable::drop_all() {
  std::uint64_t items = 0;
  for (const Bitmap& bits : grades_) {
    while (!bits.empty()) {
      items += remove(bits.first()).items;
    }
  }
  return items;
}

std::size_t OpenTable::bytes_for(const Layout& layout) {
  return layout.slots * sizeof(detail::OpenSlot) + kGrades * Bitmap(layout.slots).bytes() +
         (layout.track_age ? layout.slots * sizeof(AgeLink) : 0);
}

}  // namespace carpool
