// Recording costs, playing runs, comparing.
#include "prediction.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <tbb/task_arena.h>

#include "contestants.h"

namespace bench {
namespace {

// Where other programs want the cores too, the shorter measurements are the truer ones.
double lower_quartile(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 4];
}

// From an invitation to the arrival of a thread that has slept.
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

// Taking something from another worker moves some three cache lines between cores: lock, list and
// block. Two threads play ball with one line.
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

// What one thread's run says about batches: so much each, and so much per item.
carpool::Simulation recorded(const carpool::RunReport& report) {
  carpool::Simulation simulation;
  simulation.jitter = 0.1;
  std::vector<double> per_item;
  double batches = 0;
  for (const carpool::StageReport& stage : report.stages) {
    per_item.push_back(stage.kernel_seconds /
                       static_cast<double>(std::max<std::uint64_t>(1, stage.items)));
    batches += static_cast<double>(stage.batches);
  }
  simulation.batch_seconds = [per_item](std::uint32_t stage, std::uint32_t items) {
    return per_item[stage] * items;
  };
  simulation.source_item_seconds =
      report.source_seconds /
      static_cast<double>(std::max<std::uint64_t>(1, report.sources[0].items));
  simulation.choose_seconds = report.scheduler_seconds / std::max(1.0, batches);  // publishing, too
  simulation.steal_seconds = measure_steal_seconds();
  simulation.wake_seconds = measure_wake_seconds();
  return simulation;
}

}  // namespace

void predict(Rows& rows, bool quick) {
  const Work work{.items = quick ? 50'000ULL : 200'000ULL, .stages = 4, .rounds = rounds_for(200)};
  const auto seconds_of = [&](int threads, const carpool::Simulation* simulation,
                              carpool::RunReport& report) {
    carpool_run(work, {.threads = threads, .in_flight = 65536, .simulation = simulation}, report);
    return report.seconds;
  };
  carpool::RunReport report;
  std::vector<double> one;
  std::vector<double> two;
  for (int round = 0; round < 5; ++round) {
    two.push_back(seconds_of(2, nullptr, report));
    one.push_back(seconds_of(1, nullptr, report));
  }
  const carpool::Simulation costs = recorded(report);
  const double measured = lower_quartile(one) / lower_quartile(two);
  rows.add("recorded: stealing a block", costs.steal_seconds * 1e9, "ns");
  rows.add("recorded: waking a thread", costs.wake_seconds * 1e6, "us");
  rows.add("recorded: choosing and publishing a batch", costs.choose_seconds * 1e9, "ns");
  const double base = seconds_of(1, &costs, report);
  for (const int workers : {2, 4, 16, 64, 256, 1024, 4096}) {
    const double faster = base / seconds_of(workers, &costs, report);
    rows.add("predicted: " + std::to_string(workers) + " workers / one", faster, "x");
    if (workers == 2) {
      rows.add("measured: 2 threads / one", measured, "x");
      rows.add("error of the prediction for 2 threads", 100 * (faster / measured - 1), "%");
    }
  }
}

}  // namespace bench
