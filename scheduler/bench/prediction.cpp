// Recording costs, playing runs, comparing.
#include "prediction.h"

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "contestants.h"
#include "machine_costs.h"

namespace bench {
namespace {

constexpr int kRounds = 5;

// Costs is what is recorded once, for all predictions.
struct Costs {
  double wake_seconds = measure_wake_seconds();
  double steal_seconds = measure_steal_seconds();
  double publish_seconds = 0;
  double bytes_per_second = 0;  // that one of two threads gets of the memory
};

double kernel_seconds(const carpool::RunReport& report) {
  double sum = 0;
  for (const carpool::StageReport& stage : report.stages) {
    sum += stage.kernel_seconds;
  }
  return sum;
}

double batches(const carpool::RunReport& report) {
  double sum = 0;
  for (const carpool::StageReport& stage : report.stages) {
    sum += static_cast<double>(stage.batches);
  }
  return sum;
}

// The same work in blocks of 256 and of 16 items: the kernels' time has what each block more takes
// to be published, for they do that themselves, and to be begun.
double measure_publish_seconds() {
  const Work work{.items = 50'000, .stages = 4, .rounds = rounds_for(20)};
  carpool::RunReport whole;
  carpool::RunReport small;
  std::vector<double> seconds;
  for (int round = 0; round < 2 * kRounds; ++round) {
    carpool_run(work, {}, whole);
    carpool_run(work, {.flush_count = 16}, small);
    seconds.push_back((kernel_seconds(small) - kernel_seconds(whole)) /
                      (batches(small) - batches(whole)));
  }
  return std::max(0.0, lower_quartile(seconds));
}

// What one thread's run says about its batches, and what was measured apart.
carpool::Simulation recorded(const carpool::RunReport& report, const Costs& costs) {
  carpool::Simulation simulation;
  simulation.jitter = 0.1;
  std::vector<double> per_item;
  for (const carpool::StageReport& stage : report.stages) {
    const double publishing = costs.publish_seconds * static_cast<double>(stage.batches);
    per_item.push_back(std::max(0.0, stage.kernel_seconds - publishing) /
                       static_cast<double>(std::max<std::uint64_t>(1, stage.items)));
  }
  simulation.batch_seconds = [per_item](std::uint32_t stage, std::uint32_t items) {
    return per_item[stage] * items;
  };
  simulation.source_item_seconds =
      report.source_seconds /
      static_cast<double>(std::max<std::uint64_t>(1, report.sources[0].items));
  simulation.choose_seconds = report.scheduler_seconds / std::max(1.0, batches(report));
  simulation.publish_seconds = costs.publish_seconds;
  simulation.steal_seconds = costs.steal_seconds;
  simulation.wake_seconds = costs.wake_seconds;
  return simulation;
}

// A run of a workload on so many threads, or played in simulation by so many workers.
using Runner = std::function<void(int threads, const carpool::Simulation*, carpool::RunReport&)>;

struct Measured {
  double faster;              // two threads over one
  carpool::RunReport report;  // of one
};

Measured measure(const Runner& run) {
  Measured measured;
  std::vector<double> one;
  std::vector<double> two;
  for (int round = 0; round < kRounds; ++round) {
    run(2, nullptr, measured.report);
    two.push_back(measured.report.seconds);
    run(1, nullptr, measured.report);
    one.push_back(measured.report.seconds);
  }
  measured.faster = lower_quartile(one) / lower_quartile(two);
  return measured;
}

// Prints what is predicted for each of `counts` workers, and for two how that compares.
void compare(Rows& rows, const std::string& what, const Runner& run, const Costs& costs,
             double bytes_per_item, const std::vector<int>& counts) {
  const Measured measured = measure(run);
  carpool::Simulation simulation = recorded(measured.report, costs);
  rows.add("recorded: choosing a batch" + what, simulation.choose_seconds * 1e9, "ns");
  simulation.batch_bytes = [=](std::uint32_t, std::uint32_t items) {
    return bytes_per_item * items;
  };
  const auto seconds_of = [&](int workers) {
    // Each further core is taken to bring memory of its own, as machines with more cores do.
    simulation.memory_bytes_per_second = costs.bytes_per_second * std::max(2, workers);
    carpool::RunReport report;
    run(workers, &simulation, report);
    return report.seconds;
  };
  const double base = seconds_of(1);
  for (const int workers : counts) {
    const double faster = base / seconds_of(workers);
    rows.add("predicted: " + std::to_string(workers) + " workers / one" + what, faster, "x");
    if (workers != 2) {
      continue;
    }
    rows.add("measured: 2 threads / one" + what, measured.faster, "x");
    rows.add("error of the prediction for 2 threads" + what, 100 * (faster / measured.faster - 1),
             "%");
  }
}

void predict_hops(Rows& rows, const Costs& costs, bool quick) {
  const Work work{.items = quick ? 50'000ULL : 200'000ULL, .stages = 4, .rounds = rounds_for(200)};
  const Runner run = [&](int threads, const carpool::Simulation* simulation,
                         carpool::RunReport& report) {
    carpool_run(work, {.threads = threads, .in_flight = 65536, .simulation = simulation}, report);
  };
  // An item is read where it waited, and written, which reads first, where it waits next: at most.
  constexpr double kBytes = 3 * sizeof(Item);
  compare(rows, "", run, costs, kBytes, {2, 4, 16, 64, 256, 1024, 4096});
}

// Kernels that do little but read memory: here cores share what decides.
void predict_reading(Rows& rows, const Costs& costs, const BigTable& table, bool quick) {
  const Runner run = [&](int threads, const carpool::Simulation* simulation,
                         carpool::RunReport& report) {
    carpool_read(table, quick ? 20'000 : 80'000, {.threads = threads, .simulation = simulation},
                 report);
  };
  compare(rows, ", reading memory", run, costs, BigTable::kPieceBytes, {2});
}

}  // namespace

void predict(Rows& rows, bool quick) {
  const BigTable table;
  Costs costs;
  costs.publish_seconds = measure_publish_seconds();
  costs.bytes_per_second = measure_memory_bandwidth(table, 2) / 2;
  rows.add("recorded: stealing a block", costs.steal_seconds * 1e9, "ns");
  rows.add("recorded: waking a thread", costs.wake_seconds * 1e6, "us");
  rows.add("recorded: publishing a block, and beginning it", costs.publish_seconds * 1e9, "ns");
  rows.add("recorded: reading memory, one thread alone", measure_memory_bandwidth(table, 1) * 1e-9,
           "GB/s");
  rows.add("recorded: reading memory, each of two threads", costs.bytes_per_second * 1e-9, "GB/s");
  predict_hops(rows, costs, quick);
  predict_reading(rows, costs, table, quick);
}

}  // namespace bench
