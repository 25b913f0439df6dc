// Small loops, repeated.
#include "machine_costs.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include <tbb/task_arena.h>

#include "workload.h"

namespace bench {

double lower_quartile(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 4];
}

double measure_wake_seconds() {
  tbb::task_arena arena(2);
  std::vector<double> seconds;
  for (int round = 0; round < 40; ++round) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));  // let it fall asleep
    std::atomic<bool> arrived{false};
    const double begin = wall_seconds();
    arena.enqueue([&] { arrived = true; });
    while (!arrived) {
    }
    seconds.push_back(wall_seconds() - begin);
  }
  return lower_quartile(seconds);
}

// Two threads play ball with one line.
double measure_steal_seconds() {
  constexpr int kTurns = 200;
  constexpr int kRounds = 200;
  std::atomic<int> ball{0};
  std::thread other([&] {
    for (int turn = 1; turn < kTurns * kRounds; turn += 2) {
      while (ball.load(std::memory_order_acquire) != turn) {
      }
      ball.store(turn + 1, std::memory_order_release);
    }
  });
  std::vector<double> seconds;
  for (int round = 0; round < kRounds; ++round) {
    const double begin = wall_seconds();
    for (int turn = round * kTurns; turn < (round + 1) * kTurns; turn += 2) {
      while (ball.load(std::memory_order_acquire) != turn) {
      }
      ball.store(turn + 1, std::memory_order_release);
    }
    seconds.push_back((wall_seconds() - begin) / kTurns);
  }
  other.join();
  return 3 * lower_quartile(seconds);
}

BigTable::BigTable() : words_(kPieces * kPieceBytes / sizeof(std::uint64_t)) {
  for (std::size_t i = 0; i < words_.size(); ++i) {
    words_[i] = mix(i);
  }
}

std::uint64_t BigTable::sum_of(std::uint64_t piece) const {
  constexpr std::size_t kWords = kPieceBytes / sizeof(std::uint64_t);
  const std::uint64_t* words = words_.data() + piece % kPieces * kWords;
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < kWords; ++i) {
    sum += words[i];
  }
  return sum;
}

double measure_memory_bandwidth(const BigTable& table, int threads) {
  constexpr std::uint64_t kReads = 16384;
  std::vector<double> rates;
  for (int round = 0; round < 4; ++round) {
    std::atomic<std::uint64_t> sum{0};
    const double begin = wall_seconds();
    std::vector<std::thread> readers;
    for (int thread = 0; thread < threads; ++thread) {
      readers.emplace_back([&, thread] {
        const std::uint64_t first = static_cast<std::uint64_t>(thread) * kReads;
        std::uint64_t part = 0;
        for (std::uint64_t i = first; i < first + kReads; ++i) {
          part += table.sum_of(make_item({}, i).hash >> 32);
        }
        sum += part;
      });
    }
    for (std::thread& reader : readers) {
      reader.join();
    }
    rates.push_back(-static_cast<double>(threads) * kReads * BigTable::kPieceBytes /
                    (wall_seconds() - begin));  // negative: the faster are the truer
  }
  return -lower_quartile(rates);
}

}  // namespace bench
