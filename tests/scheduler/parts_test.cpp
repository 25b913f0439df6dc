// The parts behind the public headers, one by one.
#include <gtest/gtest.h>

#include <set>
#include <thread>
#include <vector>

#include "bitmap.h"
#include "block_pool.h"
#include "credits.h"
#include "gate.h"
#include "layout.h"
#include "random_graph.h"
#include "ready_queue.h"

namespace {

using carpool::Bitmap;
using carpool::BlockCache;
using carpool::BlockPool;
using carpool::CreditCache;
using carpool::Credits;
using carpool::Gate;
using carpool::Layout;
using carpool::ReadyBlock;
using carpool::ReadyQueue;
using carpool_test::mix;

TEST(BitmapTest, AgreesWithASet) {
  for (const std::uint32_t size : {1U, 63U, 64U, 65U, 4096U, 4097U, 300'000U}) {
    Bitmap bits(size);
    std::set<std::uint32_t> model;
    std::uint64_t dice = size;
    for (int step = 0; step < 3000; ++step) {
      dice = mix(dice + 1);
      const auto index = static_cast<std::uint32_t>((dice >> 8) % size);
      if (dice % 2 == 0) {
        bits.set(index);
        model.insert(index);
      } else {
        bits.clear(index);
        model.erase(index);
      }
      ASSERT_EQ(bits.test(index), model.contains(index));
      ASSERT_EQ(bits.empty(), model.empty());
      ASSERT_EQ(bits.first(), model.empty() ? Bitmap::kNone : *model.begin());
      const auto from = static_cast<std::uint32_t>((dice >> 40) % size);
      const auto at = model.lower_bound(from);
      const std::uint32_t next = at != model.end() ? *at : bits.first();
      ASSERT_EQ(bits.first_from(from), next) << size << " from " << from;
    }
  }
}

ReadyBlock ready_block(std::uint32_t lane, std::uint32_t items, bool partial) {
  ReadyBlock ready;
  ready.block.items = items;
  ready.lane = lane;
  ready.partial = partial;
  return ready;
}

TEST(ReadyQueueTest, LanesThenAge) {
  std::atomic<std::uint32_t> size{0};
  ReadyQueue queue(8, size);
  ReadyBlock partial = ready_block(4, 1, true);
  ReadyBlock late_lane = ready_block(3, 9, false);
  ReadyBlock first = ready_block(1, 9, false);
  ReadyBlock second = ready_block(1, 9, false);
  for (ReadyBlock* ready : {&partial, &late_lane, &first, &second}) {
    queue.push(ready);
  }
  EXPECT_EQ(size.load(), 4U);
  EXPECT_EQ(queue.partials(), 1U);
  EXPECT_EQ(queue.take(true, 8), &second);  // the newest of its lane
  queue.push(&second);
  EXPECT_EQ(queue.take(false, 8), &first);  // the oldest
  EXPECT_EQ(queue.take(false, 8), &second);
  EXPECT_EQ(queue.take(false, 8), &late_lane);
  EXPECT_EQ(queue.take(false, 4), nullptr);  // not that far
  EXPECT_EQ(queue.take(false, 8), &partial);
  EXPECT_EQ(queue.take(false, 8), nullptr);
  EXPECT_EQ(queue.partials(), 0U);
}

TEST(ReadyQueueTest, ThievesTakeHalfOfTinyBlocksAndOneOfLargeOnes) {
  std::atomic<std::uint32_t> size{0};
  ReadyQueue queue(2, size);
  std::vector<ReadyBlock> tiny(8, ready_block(1, 1, true));
  for (ReadyBlock& ready : tiny) {
    queue.push(&ready);
  }
  std::uint32_t stolen = 0;
  for (const ReadyBlock* ready = queue.steal(32); ready != nullptr; ready = ready->newer) {
    EXPECT_EQ(ready, &tiny[stolen++]);  // the oldest first
  }
  EXPECT_EQ(stolen, 4U);
  EXPECT_EQ(size.load(), 4U);
  ReadyBlock large = ready_block(0, 256, false);
  queue.push(&large);
  EXPECT_EQ(queue.steal(32), &large);
  EXPECT_EQ(size.load(), 4U);
}

TEST(CreditsTest, WhatIsTakenComesBack) {
  Credits purse(1000);
  CreditCache a(purse, 2);
  CreditCache b(purse, 2);
  EXPECT_EQ(a.reserve(100, 600), 600);
  EXPECT_EQ(b.reserve(500, 600), 0);  // only 400 are left
  EXPECT_EQ(b.reserve(100, 600), 400);
  a.settle(600, 0);  // emitted 600 items
  b.settle(0, 600);  // which another worker retired
  EXPECT_LE(b.pocket(), 250);
  a.settle(50, 0);  // an overdraft
  a.return_all();
  b.return_all();
  EXPECT_EQ(purse.available(), 950);
  a.settle(0, 50);
  a.return_all();
  EXPECT_EQ(purse.available(), 1000);
  EXPECT_EQ(a.peak_lent(), 600U);
}

TEST(GateTest, TheLastToLeaveClosesIt) {
  Gate gate(3);
  EXPECT_EQ(gate.take_seat(), 0U);
  EXPECT_TRUE(gate.hungry(gate.view()));
  EXPECT_EQ(gate.invite(), Gate::Invited::helper);
  EXPECT_EQ(gate.invite(), Gate::Invited::helper);
  EXPECT_EQ(gate.invite(), Gate::Invited::nobody);  // three seats, all spoken for
  EXPECT_TRUE(gate.enter());
  EXPECT_FALSE(gate.hungry(gate.view()));  // somebody is searching
  gate.begin_search();
  gate.release_seat(0);
  EXPECT_EQ(gate.leave(true), Gate::Left::gone);  // the caller sleeps, the helper is still there
  EXPECT_FALSE(gate.view().closed());
  EXPECT_EQ(gate.leave(false), Gate::Left::gone);
  EXPECT_TRUE(gate.view().closed());
  EXPECT_FALSE(gate.wait_for_invitation());
  EXPECT_FALSE(gate.enter());  // the second helper comes too late
}

TEST(GateTest, WhoLeavesLooksBack) {
  Gate gate(2);
  EXPECT_EQ(gate.invite(), Gate::Invited::helper);
  EXPECT_TRUE(gate.enter());
  gate.ready_size(0).store(1);
  EXPECT_EQ(gate.leave(false), Gate::Left::stays);
  EXPECT_EQ(gate.view().active(), 2U);
  EXPECT_EQ(gate.view().searching(), 1U);
  gate.ready_size(0).store(0);
  EXPECT_EQ(gate.leave(false), Gate::Left::gone);
  EXPECT_EQ(gate.view().active(), 1U);
}

TEST(GateTest, ASleepingCallerIsCalledFirst) {
  Gate gate(2);
  ASSERT_EQ(gate.invite(), Gate::Invited::helper);
  ASSERT_TRUE(gate.enter());
  gate.end_search();
  gate.begin_search();
  ASSERT_EQ(gate.leave(true), Gate::Left::gone);
  EXPECT_TRUE(gate.view().caller_asleep());
  EXPECT_EQ(gate.invite(), Gate::Invited::caller);
  EXPECT_TRUE(gate.wait_for_invitation());  // returns at once
  EXPECT_TRUE(gate.enter());
  EXPECT_EQ(gate.view().active(), 2U);
}

carpool::Graph two_stages() {
  carpool::Graph graph;
  const auto small =
      graph.add_stage<std::uint32_t>({.name = "small", .bins = 100, .block_items = 256});
  const auto large =
      graph.add_stage<std::array<double, 9>>({.name = "large", .bins = 3, .block_items = 50});
  graph.set_kernel(small, [](const auto&, carpool::Emitter&) {});
  graph.set_kernel(large, [](const auto&, carpool::Emitter&) {});
  graph.add_source({.name = "s", .fan_out = 3}, [](carpool::SourceContext&, carpool::Emitter&) {
    return carpool::SourceStatus::exhausted;
  });
  return graph;
}

TEST(LayoutTest, BlocksGrowFromALineToTheFullBatch) {
  const carpool::Graph graph = two_stages();
  const Layout layout(graph, {.in_flight = 1000}, 16);
  for (const carpool::StageLayout& stage : layout.stages) {
    EXPECT_EQ(stage.levels[stage.top_level].items, stage.block_items);
    EXPECT_LE(stage.levels[0].bytes, std::max(64U, (stage.item_bytes + 63) / 64 * 64));
    for (std::uint32_t level = 0; level <= stage.top_level; ++level) {
      EXPECT_GE(stage.levels[level].bytes, stage.levels[level].items * stage.item_bytes);
      EXPECT_EQ(layout.classes[stage.levels[level].pool_class].bytes, stage.levels[level].bytes);
    }
  }
  EXPECT_EQ(layout.stages[0].weight, 3U);  // inherited from the source
}

TEST(LayoutTest, MoreOfAnythingNeverNeedsLess) {
  const carpool::Graph graph = two_stages();
  const auto bytes = [&](std::uint64_t in_flight, std::uint32_t workers) {
    const Layout layout(graph, {.in_flight = in_flight}, workers);
    return layout.block_bytes() + layout.table_bytes();
  };
  EXPECT_LT(bytes(1000, 2), bytes(1'000'000, 2));
  EXPECT_LT(bytes(1000, 2), bytes(1000, 64));
}

TEST(LayoutTest, TooFewCreditsForOneItemAreRefused) {
  const carpool::Graph graph = two_stages();
  EXPECT_THROW(Layout(graph, {.in_flight = 2}, 1), std::invalid_argument);
  EXPECT_THROW(Layout(graph, {.in_flight = 0}, 1), std::invalid_argument);
  EXPECT_NO_THROW(Layout(graph, {.in_flight = 3}, 1));
}

TEST(BlockPoolTest, HandsOutExactlyItsLimit) {
  const carpool::Graph graph = two_stages();
  const Layout layout(graph, {.in_flight = 100}, 2);
  BlockPool pool(layout, carpool::Overflow::fail);
  BlockCache cache(pool, layout);
  for (std::uint32_t c = 0; c < layout.classes.size(); ++c) {
    std::set<std::byte*> blocks;
    for (std::uint64_t i = 0; i < layout.classes[c].limit; ++i) {
      std::byte* block = cache.allocate(c);
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(block) % 64, 0U);
      EXPECT_TRUE(blocks.insert(block).second);
    }
    EXPECT_THROW(cache.allocate(c), carpool::OverflowError);
    for (std::byte* block : blocks) {
      cache.release(c, block);
    }
    EXPECT_TRUE(blocks.contains(cache.allocate(c)));  // recycled
  }
  EXPECT_EQ(pool.allocated_bytes(), layout.block_bytes());
}

TEST(BlockPoolTest, BlocksTravelBetweenWorkers) {
  const carpool::Graph graph = two_stages();
  const Layout layout(graph, {.in_flight = 1000}, 2);
  BlockPool pool(layout, carpool::Overflow::fail);
  BlockCache giver(pool, layout);
  BlockCache taker(pool, layout);
  for (int i = 0; i < 100'000; ++i) {
    giver.release(0, taker.allocate(0));  // never more than one in use
  }
  EXPECT_LE(pool.allocated_bytes(), layout.block_bytes());
}

TEST(CreditsTest, WhatAPocketHoldsIsNotFreeWhileThePurseIsInDebt) {
  carpool::Credits purse(100);
  carpool::CreditCache mine(purse, 2);
  carpool::CreditCache other(purse, 2);
  EXPECT_EQ(other.reserve(90, 100), 100);
  other.settle(130, 0);  // items have grown into more than there are credits for
  EXPECT_EQ(purse.available(), -30);
  mine.settle(0, 20);  // others have retired here
  EXPECT_EQ(mine.pocket(), 20);
  EXPECT_EQ(mine.reserve(3, 20), 0) << "or more would be in flight than the limit allows";
  mine.return_all();
  EXPECT_EQ(purse.available(), -10);
  other.settle(0, 40);
  other.return_all();
  EXPECT_EQ(mine.reserve(3, 20), 20);
}

TEST(CreditsTest, WhatACallHasReservedStaysWithIt) {
  carpool::Credits purse(100);
  carpool::CreditCache mine(purse, 2);
  carpool::CreditCache other(purse, 2);
  EXPECT_EQ(mine.reserve(3, 90), 90);
  mine.charge(0);  // the call publishes what an earlier one had left open
  mine.charge(30);
  EXPECT_EQ(mine.pocket(), 60);
  EXPECT_EQ(other.reserve(11, 90), 0) << "or both would emit for the same credits";
  mine.settle(10, 0);  // the end of the call: the rest may go
  EXPECT_EQ(mine.pocket() + purse.available(), 60);
  EXPECT_GE(purse.available(), 20);
}

}  // namespace
