// Random shapes of graphs and settings of runs.
#include "random_settings.h"

#include <array>

namespace carpool_test {
namespace {

carpool::Policy random_policy(std::uint64_t dice) {
  switch (dice % 4) {
    case 0:
      return carpool::Policy::deepest_first();
    case 1:
      return carpool::Policy::fullest_first();
    case 2:
      return carpool::Policy::oldest_first();
    default:
      break;
  }
  switch (dice / 4 % 3) {
    case 0:
      return carpool::Policy::bins_in_order();
    case 1:
      return carpool::Policy::bins_in_ring();
    default:
      return carpool::Policy::custom("by bin", 32, [](const carpool::BlockInfo& block) {
        return block.bin % 40;  // some lanes are too high, which must not matter
      });
  }
}

}  // namespace

Shape random_shape(std::uint64_t seed) {
  const auto dice = [&](std::uint64_t salt, std::uint64_t sides) {
    return static_cast<std::uint32_t>(mix(seed * 97 + salt) % sides);
  };
  return {.seed = seed,
          .stages = 1 + dice(1, 6),
          .most_bins = std::array<std::uint32_t, 4>{1, 8, 100, 3000}[dice(2, 4)],
          .block_items = std::array<std::uint32_t, 4>{1, 7, 64, 300}[dice(3, 4)],
          .sources = 1 + dice(4, 3),
          .items = 300 + dice(5, 1500),
          .most_hops = 1 + dice(6, 8),
          .fan_out = std::array<std::uint32_t, 4>{1, 1, 3, 10}[dice(7, 4)],
          .source_concurrency = dice(8, 3),
          .one_bin_flood = dice(9, 5) == 0,
          .uneven = dice(10, 3) == 0,
          .lumps = dice(13, 12) == 0,
          .sleeping = dice(14, 20) == 0,
          .ping_pong = dice(15, 8) == 0,
          .split_early = dice(11, 2) == 0,
          .explicit_weights = dice(12, 2) == 0,
          .caps = dice(13, 3) == 0,
          .blocking = dice(14, 4) == 0};
}

carpool::RunOptions random_options(std::uint64_t seed, std::uint32_t threads) {
  const std::array<std::uint64_t, 5> credits{10, 33, 500, 5000, 131072};
  const std::uint64_t dice = mix(seed * 131 + 5);
  carpool::RunOptions options{
      .threads = threads, .in_flight = credits[dice % 5], .policy = random_policy(dice >> 8)};
  if ((dice >> 16) % 3 == 0) {
    options.flush.count = static_cast<std::uint32_t>(1 + (dice >> 20) % 50);
  }
  if ((dice >> 32) % 4 == 0) {
    options.flush.linger = std::chrono::microseconds(1 + (dice >> 36) % 100);
  }
  if ((dice >> 40) % 8 == 0) {
    options.flush.idle = false;
  }
  return options;
}

}  // namespace carpool_test
