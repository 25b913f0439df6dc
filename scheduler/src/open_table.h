// One worker's open blocks: the slow half of emitting, and the choice of which partial block
// leaves.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bitmap.h"
#include "block.h"
#include "block_pool.h"
#include "carpool/emitter.h"
#include "carpool/policy.h"
#include "layout.h"
#include "stats.h"

namespace carpool {

// BlockSink is told of blocks that have become full.
class BlockSink {
 public:
  virtual void publish(const Block& block, FlushCause cause) = 0;

 protected:
  ~BlockSink() = default;
};

// OpenTable keeps, for each (stage, bin), the block that this worker is filling.
//
// Blocks are kept in bitmaps by grade, which is how full they are on a scale of powers of four.
// So the fullest and the deepest are found without a scan. Bits are in order of rank. A block
// changes its grade in the slow path of emit, which `OpenSlot::end` triggers also where there is
// memory left. Owned and used by one worker.
class OpenTable final : public Emitter {
 public:
  OpenTable(const Layout& layout, const Policy& policy, BlockCache& cache, BlockSink& sink);

  // begin_kernel and begin_source prepare for the emits of a call.
  void begin_kernel(std::uint32_t stage, const std::uint8_t* allowed) {
    begin_call(stage, allowed, layout_.weight_of.data(), 0);
  }
  void begin_source(std::uint32_t node, const std::uint8_t* allowed) {
    begin_call(node, allowed, layout_.tally_of.data(), kTallyShift);
  }

  // take_spent returns the credits that items hold which were emitted since it was last asked.
  std::int64_t take_spent() {
    const std::uint64_t spent = tally_ >> tally_shift_;
    tally_ -= spent << tally_shift_;
    return static_cast<std::int64_t>(spent);
  }

  // emitted_items counts what a source has emitted in this call.
  std::uint32_t emitted_items() const { return static_cast<std::uint32_t>(tally_); }

  // take_best removes the block that should leave first. False if there is none.
  bool take_best(Block& block);

  // nearest returns the bit of the block whose bin comes first, counted from `begin` round a ring
  // of `ring` bins, and how far that is; Bitmap::kNone if there is none. take() removes it.
  struct Nearest {
    std::uint32_t bit = Bitmap::kNone;
    std::uint32_t distance = ~0U;
  };
  Nearest nearest(std::uint32_t begin, std::uint32_t ring) const;
  Block take(std::uint32_t bit) { return remove(bit); }

  // begin_at says where bins in order begin: see nearest().
  void begin_at(std::uint32_t bin) { first_bin_ = bin; }

  // take_fullest removes the fullest block of one stage. False if it has none.
  bool take_fullest(std::uint32_t stage, Block& block);

  // absorb appends the items of a block to the open one of its stage and bin; the memory stays the
  // caller's.
  void absorb(const Block& block);

  // take_older_than removes the oldest block if it was opened before `ticks`. Needs
  // Layout::track_age.
  bool take_older_than(std::uint64_t ticks, Block& block);

  // How many blocks are open.
  std::uint32_t count() const { return static_cast<std::uint32_t>(count_.get()); }

  // set_time says what time blocks that are opened from now on get.
  void set_time(std::uint64_t ticks) { now_ = ticks; }

  // drop_all forgets every open block and returns how many items were in them.
  std::uint64_t drop_all();

  // bytes_for returns how much memory the table of one worker takes; it never changes.
  static std::size_t bytes_for(const Layout& layout);

 private:
  struct AgeLink {
    std::uint32_t older = Bitmap::kNone;
    std::uint32_t newer = Bitmap::kNone;
    std::uint64_t opened = 0;
  };

  void begin_call(std::uint32_t emitting, const std::uint8_t* allowed,
                  const std::uint64_t* tally_of, unsigned tally_shift) {
    emitting_ = emitting;
    allowed_ = allowed;
    tally_of_ = tally_of;
    tally_shift_ = tally_shift;
    tally_ = 0;
  }
  void make_room(std::uint32_t stage, std::uint32_t bin) override;
  void open(const StageLayout& stage, std::uint32_t bin);
  void go_up(const StageLayout& stage, std::uint32_t bin);
  Block remove(std::uint32_t bit);
  std::uint32_t items_in(const StageLayout& stage, const detail::OpenSlot& slot) const {
    // A division by multiplying, exact because the difference is a multiple of item_bytes.
    const auto bytes = static_cast<std::uint64_t>(slot.write - slot.begin);
    return static_cast<std::uint32_t>(bytes * stage.item_bytes_inverse >> 32);
  }
  void set_grade(std::uint32_t grade, std::uint32_t bit) {
    grades_[grade].set(bit);
    grades_in_use_ |= 1U << grade;
  }
  void clear_grade(std::uint32_t grade, std::uint32_t bit) {
    grades_[grade].clear(bit);
    grades_in_use_ &= ~(std::uint32_t{grades_[grade].empty()} << grade);
  }
  std::uint32_t choose();
  std::uint32_t choose_by_lane_function();

  void link(std::uint32_t slot);
  void unlink(std::uint32_t slot);

  const Layout& layout_;
  const Policy& policy_;
  BlockCache& cache_;
  BlockSink& sink_;
  unsigned tally_shift_ = 0;  // where the credits begin in the tally
  std::vector<detail::OpenSlot> table_;
  std::array<Bitmap, kGrades> grades_;
  std::uint32_t grades_in_use_ = 0;  // a bit per grade
  std::vector<AgeLink> ages_;
  std::uint32_t oldest_ = Bitmap::kNone;
  std::uint32_t newest_ = Bitmap::kNone;
  std::uint32_t cursor_ = 0;
  std::uint32_t first_bin_ = 0;  // where bins in order begin
  Counter count_;                // others may look at it
  std::uint64_t now_ = 0;
};

}  // namespace carpool
