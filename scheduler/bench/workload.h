// The work that every contestant of the benchmark does: items that hop from stage to stage under a
// key.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <vector>

namespace bench {

struct Item {
  std::uint64_t hash = 0;  // the state; also decides where the item goes next
  std::uint32_t left = 0;  // hops to go
  std::uint32_t id = 0;
};

struct Work {
  std::uint64_t items = 200'000;
  std::uint32_t stages = 16;
  std::uint32_t keys = 64;
  std::uint32_t rounds = 20;    // of the kernel: a chain of dependent instructions
  std::uint32_t hops = 8;       // on average
  std::uint32_t long_tail = 0;  // one item in so many has a thousand hops; zero: none
  const std::vector<std::uint64_t>* table = nullptr;  // 32 KiB for each key, read by the kernel
};

inline constexpr std::uint32_t kTableWords = 4096;  // 32 KiB

inline std::uint64_t mix(std::uint64_t x) {
  x ^= x >> 29;
  x *= 0xbf58476d1ce4e5b9ULL;
  return x;
}

inline Item make_item(const Work& work, std::uint64_t id) {
  std::uint64_t hash = (id + 1) * 0x9e3779b97f4a7c15ULL;
  hash = mix(mix(hash));
  const bool is_long = work.long_tail != 0 && id % work.long_tail == 0;
  const auto hops = static_cast<std::uint32_t>(1 + (hash >> 40) % (2 * work.hops - 1));
  return {.hash = hash, .left = is_long ? 1000 : hops, .id = static_cast<std::uint32_t>(id)};
}

// A hash's upper bits as a number below `count`, without a division.
inline std::uint32_t below(std::uint32_t count, std::uint32_t bits) {
  return static_cast<std::uint32_t>(std::uint64_t{bits} * count >> 32);
}

inline std::uint32_t stage_of(const Work& work, std::uint64_t hash) {
  return below(work.stages, static_cast<std::uint32_t>(hash >> 32));
}

inline std::uint32_t key_of(const Work& work, std::uint64_t hash) {
  return below(work.keys, static_cast<std::uint32_t>(hash));
}

// visit is one hop. The time is in the chain: the next round needs the result of the one before.
inline void visit(const Work& work, Item& item) {
  std::uint64_t hash = item.hash;
  if (work.table != nullptr) {
    const std::uint64_t* words = work.table->data() + std::size_t{key_of(work, hash)} * kTableWords;
    for (std::uint32_t round = 0; round < work.rounds; ++round) {
      hash = mix(hash + words[(hash >> 20) % kTableWords]);
    }
  } else {
    for (std::uint32_t round = 0; round < work.rounds; ++round) {
      hash = mix(hash);
    }
  }
  item.hash = hash * 0x9e3779b97f4a7c15ULL;
  --item.left;
}

// Result is the same for every contestant that did the whole work.
struct alignas(64) Result {
  std::uint64_t sum = 0;
  std::uint64_t visits = 0;
  void retire(const Item& item) { sum += mix(item.hash + item.id); }
  Result& operator+=(const Result& other) {
    sum += other.sum;
    visits += other.visits;
    return *this;
  }
};

inline double cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

inline double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// rounds_for returns how many rounds take so many nanoseconds in a loop over one item.
inline std::uint32_t rounds_for(double nanoseconds) {
  std::uint64_t hash = 1;
  constexpr int kRounds = 4'000'000;
  double best = 1e9;
  for (int attempt = 0; attempt < 3; ++attempt) {
    const double begin = cpu_seconds();
    for (int i = 0; i < kRounds; ++i) {
      hash = mix(hash);
    }
    best = std::min(best, cpu_seconds() - begin);
  }
  volatile std::uint64_t keep = hash;
  (void)keep;
  const double per_round = best / kRounds * 1e9;
  return static_cast<std::uint32_t>(nanoseconds / per_round + 0.5);
}

}  // namespace bench
