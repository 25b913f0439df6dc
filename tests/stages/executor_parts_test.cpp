// The executors' parts: which packets a pass hands out, how rays are gathered, how slots go round,
// how bins are coarsened.
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <limits>
#include <map>
#include <mutex>
#include <set>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "stages/executors/binning.h"
#include "stages/executors/camera_group.h"
#include "stages/executors/camera_work.h"
#include "stages/executors/slot_pool.h"
#include "stages/kernels/check_outputs.h"

namespace carpool::stages {
namespace {

using Key = std::tuple<uint32_t, uint32_t, uint32_t>;

std::map<Key, int> Visits(uint32_t width, uint32_t height, const CameraPass& pass, uint32_t chunk) {
  CameraWork work(width, height, pass);
  std::map<Key, int> visits;
  while (work.Claim(0, chunk, [&](const CameraPacket& p) { ++visits[{p.x, p.y, p.sample}]; })) {
  }
  EXPECT_EQ(work.Fraction(), 1);
  return visits;
}

TEST(CameraWork, CoversEveryGroupOfEverySampleOnce) {
  for (const uint32_t chunk : {1u, 7u, 32u, 1000u}) {
    const auto visits = Visits(37, 21, {.first_sample = 5, .sample_count = 3}, chunk);
    EXPECT_EQ(visits.size(), 10u * 11 * 3);  // groups of 4x2 that touch 37x21
    for (const auto& [key, count] : visits) {
      EXPECT_EQ(count, 1);
      EXPECT_EQ(std::get<0>(key) % kGroupWidth, 0u);
      EXPECT_GE(std::get<2>(key), 5u);
      EXPECT_LT(std::get<2>(key), 8u);
    }
  }
}

TEST(CameraWork, PhasesPartitionThePass) {
  std::map<Key, int> all;
  for (uint32_t phase = 0; phase < kPhases; ++phase) {
    const auto visits =
        Visits(64, 64, {.first_sample = 0, .sample_count = 1, .phases = 1u << phase}, 16);
    EXPECT_EQ(visits.size(), 16u * 32 / kPhases);
    for (const auto& [key, count] : visits) all[key] += count;
  }
  EXPECT_EQ(all.size(), 16u * 32);
  for (const auto& [key, count] : all) EXPECT_EQ(count, 1);
}

TEST(CameraRays, PlacesOutsideTheImageIdle) {
  KernelContext c;
  c.width = 6;
  c.height = 3;
  CameraRays rays;
  AddGroup(c, {0, 0, 7}, rays);
  AddGroup(c, {4, 2, 8}, rays);  // of 4x2 pixels the upper left two are in the image
  ASSERT_EQ(rays.count, 2 * kCameraGroup);
  std::set<uint32_t> first;
  for (uint32_t i = 0; i < kCameraGroup; ++i) {
    EXPECT_EQ(rays.inside[i], -1);
    EXPECT_EQ(rays.sample[i], 7u);
    first.insert(rays.pixel[i]);
  }
  EXPECT_EQ(first, (std::set<uint32_t>{0, 1, 2, 3, 6, 7, 8, 9}));
  for (uint32_t i = 0; i < kCameraGroup; ++i) {
    const uint32_t place = kCameraGroup + i;
    EXPECT_EQ(rays.inside[place], i < 2 ? -1 : 0);
    EXPECT_EQ(rays.sample[place], 8u);
    EXPECT_EQ(rays.pixel[place], i == 1 ? 17u : 16u);  // idle ones repeat the first
  }
}

using Tile = std::pair<uint32_t, uint32_t>;
Tile TileOf(const CameraPacket& p) {
  return {p.x / kTileSize, p.y / kTileSize};
}

TEST(CameraWork, WorkersKeepToTilesOfTheirOwn) {
  constexpr uint32_t kWorkers = 3, kSamples = 8;
  CameraWork work(160, 80, {.sample_count = kSamples}, kWorkers);
  std::map<Tile, std::set<uint32_t>> workers;
  for (uint32_t turn = 0; turn < 3 * kSamples; ++turn) {
    work.Claim(turn % kWorkers, kGroupsPerTile,
               [&](const CameraPacket& p) { workers[TileOf(p)].insert(turn % kWorkers); });
  }
  EXPECT_EQ(workers.size(), 3u);  // each has had all samples of one
  for (const auto& [tile, by] : workers) EXPECT_EQ(by.size(), 1u);
}

TEST(CameraWork, HelpsWithTheLastTiles) {
  CameraWork work(16, 16, {.sample_count = 4}, 2);
  std::set<uint32_t> first, second;
  EXPECT_TRUE(work.Claim(0, kGroupsPerTile, [&](const auto& p) { first.insert(p.sample); }));
  EXPECT_FALSE(
      work.Claim(1, 100 * kGroupsPerTile, [&](const auto& p) { second.insert(p.sample); }));
  EXPECT_EQ(first, (std::set<uint32_t>{0}));
  EXPECT_EQ(second, (std::set<uint32_t>{1, 2, 3}));
  EXPECT_EQ(work.Fraction(), 1);
  EXPECT_FALSE(work.Claim(0, 1, [](const auto&) { ADD_FAILURE(); }));
}

TEST(CameraWork, WorkersTogetherCoverEverythingOnce) {
  constexpr uint32_t kWorkers = 4, kWidth = 200, kHeight = 100, kSamples = 5;
  for (int round = 0; round < 20; ++round) {
    CameraWork work(kWidth, kHeight, {.sample_count = kSamples}, kWorkers);
    std::vector<std::atomic<int>> visits(kWidth / 4 * (kHeight / 2) * kSamples);
    tbb::parallel_for(
        uint32_t{0}, kWorkers,
        [&](uint32_t worker) {
          while (work.Claim(worker, 1 + worker * 5, [&](const CameraPacket& p) {
            ++visits[((p.y / 2) * (kWidth / 4) + p.x / 4) * kSamples + p.sample];
          })) {
          }
        },
        tbb::simple_partitioner());
    EXPECT_EQ(work.Fraction(), 1);
    for (const auto& count : visits) ASSERT_EQ(count, 1);
  }
}

TEST(SlotPool, KeepsWorkersToTheirRanges) {
  SlotPool pool(40000, 4);
  std::vector<uint32_t> slots[4];
  for (uint32_t worker = 0; worker < 4; ++worker) {
    slots[worker].resize(5000);
    pool.Take(worker, slots[worker]);
  }
  pool.Give(0, slots[3]);  // as after a theft
  pool.Give(3, slots[0]);
  const uint32_t range = pool.capacity() / 4;
  for (uint32_t worker = 0; worker < 4; ++worker) {
    size_t foreign = 0;
    std::vector<uint32_t> again(5000);
    pool.Take(worker, again);
    for (const uint32_t slot : again) foreign += slot / range != worker ? 1 : 0;
    EXPECT_LE(foreign, 1024u);  // what it has at hand
  }
}

TEST(SlotPool, NeverHandsOutASlotTwiceAndNeverRunsDry) {
  constexpr uint32_t kInFlight = 3000, kWorkers = 4;
  SlotPool pool(kInFlight, kWorkers);
  std::vector<std::atomic<int>> taken(pool.capacity());
  tbb::parallel_for(
      uint32_t{0}, kWorkers,
      [&](uint32_t worker) {
        std::vector<uint32_t> mine;
        for (int round = 0; round < 200; ++round) {
          while (mine.size() < kInFlight / kWorkers) {
            const size_t first = mine.size(), room = kInFlight / kWorkers - first;
            mine.resize(first + std::min<size_t>(room, static_cast<size_t>(round) * 7 + 1));
            pool.Take(worker, std::span(mine).subspan(first));
            for (size_t i = first; i < mine.size(); ++i) {
              ASSERT_LT(mine[i], pool.capacity());
              EXPECT_EQ(taken[mine[i]].fetch_add(1), 0);
            }
          }
          const size_t keep = static_cast<size_t>(round * 37) % mine.size();
          const std::vector<uint32_t> back(mine.begin() + static_cast<ptrdiff_t>(keep), mine.end());
          for (const uint32_t slot : back) taken[slot].fetch_sub(1);
          mine.resize(keep);
          pool.Give(worker, back);
        }
      },
      tbb::simple_partitioner());
}

TEST(ShadeBins, KeepsMaterialsApartWhileTheyCanBeFilled) {
  const ShadeBins few(5, 8, 65536, 256);
  std::set<uint32_t> bins;
  for (int32_t m = 0; m < 5; ++m) {
    for (uint32_t depth = 0; depth < 4; ++depth) bins.insert(few.Of(m, depth));
  }
  EXPECT_EQ(bins.size(), 20u);
  EXPECT_EQ(few.count(), 20u);
  EXPECT_TRUE(few.Note().empty());
  EXPECT_EQ(few.Of(2, 3), few.Of(2, 200));  // all deep ones together
}

TEST(ShadeBins, CoarsensAndSaysSo) {
  const ShadeBins many(10000, 8, 65536, 256);
  EXPECT_LE(many.count(), 128u);
  EXPECT_FALSE(many.Note().empty());
  for (int32_t m = 0; m < 10000; ++m) EXPECT_LT(many.Of(m, 7), many.count());
  const ShadeBins tiny(3, 8, 100, 4096);
  EXPECT_EQ(tiny.count(), 1u);
}

TEST(CheckOutputs, NamesWhatIsWrong) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  PathState good = {};
  good.direction[1] = -1;
  good.throughput[0] = 1;
  EXPECT_EQ(FaultOf(good), nullptr);
  const auto fault = [&](auto change) {
    PathState path = good;
    change(path);
    const char* const name = FaultOf(path);
    return std::string(name != nullptr ? name : "nothing");
  };
  EXPECT_EQ(fault([](PathState& p) { p.origin[2] = kNan; }), "origin");
  EXPECT_EQ(fault([](PathState& p) { p.direction[1] = -0.99f; }), "direction");
  EXPECT_EQ(fault([](PathState& p) { p.pdf = kNan; }), "pdf");
  EXPECT_EQ(fault([](PathState& p) { p.throughput[1] = -1e-9f; }), "throughput");
  EXPECT_EQ(fault([](PathState& p) { p.radiance[0] = kNan; }), "radiance");
}

}  // namespace
}  // namespace carpool::stages
