// bench-scheduler: what an item-visit costs here and elsewhere, all measured in one run.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <iterator>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "allocations.h"
#include "carpool/carpool.h"
#include "contestants.h"
#include "memory.h"
#include "prediction.h"
#include "rows.h"
#include "sssp.h"
#include "transport.h"

namespace {

using bench::Result;
using bench::Setup;
using bench::Work;

bench::Rows rows;

struct Cost {
  double cpu_ns = 1e30;   // CPU time per visit
  double wall_ns = 1e30;  // wall time per visit
};

using Contestant = std::function<Result(const Work&, const Setup&)>;

const Contestant kCarpool = [](const Work& work, const Setup& setup) {
  return bench::carpool_run(work, setup);
};

// run_once counts time and refuses a contestant that did not do the work.
Cost run_once(Contestant run, const Work& work, const Setup& setup, const Result& expected) {
  const double cpu = bench::cpu_seconds();
  const double wall = bench::wall_seconds();
  const Result result = run(work, setup);
  const double cpu_spent = bench::cpu_seconds() - cpu;
  const double wall_spent = bench::wall_seconds() - wall;
  if (result.sum != expected.sum || result.visits != expected.visits) {
    std::fprintf(stderr, "bench-scheduler: a contestant did not do the work; this is a bug\n");
    std::exit(1);
  }
  const double visits = static_cast<double>(expected.visits);
  return {.cpu_ns = cpu_spent / visits * 1e9, .wall_ns = wall_spent / visits * 1e9};
}

// measure lets the contestants take turns, and takes the best CPU time of each: on a shared machine
// the smallest is the truest.
std::vector<Cost> measure(const std::vector<Contestant>& contestants, const Work& work,
                          const Setup& setup, const Result& expected, int rounds = 5) {
  std::vector<Cost> best(contestants.size());
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < contestants.size(); ++i) {
      const Cost cost = run_once(contestants[i], work, setup, expected);
      best[i].cpu_ns = std::min(best[i].cpu_ns, cost.cpu_ns);
      best[i].wall_ns = std::min(best[i].wall_ns, cost.wall_ns);
    }
  }
  return best;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

// wall_ratio is the median over rounds of wall time a / wall time b, each pair measured together.
double wall_ratio(const std::function<Cost()>& a, const std::function<Cost()>& b, int rounds = 5) {
  std::vector<double> ratios;
  for (int round = 0; round < rounds; ++round) {
    const double first = a().wall_ns;
    ratios.push_back(first / b().wall_ns);
  }
  return median(ratios);
}

struct Keys {
  std::uint32_t stages;
  std::uint32_t keys;
};

std::string label(Keys keys, double kernel_ns, int threads) {
  char text[128];
  std::snprintf(text, sizeof text, ": %ux%u keys, %g ns, %d thread%s", keys.stages, keys.keys,
                kernel_ns, threads, threads == 1 ? "" : "s");
  return text;
}

// Everybody on the same work; `rivals` adds those that send one message or task per item. Many
// items, so that what is done once, as filling the bins, does not count.
void compare(double kernel_ns, int threads, Keys keys, bool rivals, bool quick = false) {
  const double item_ns = quick ? 3e6 : 2e7;
  const Work work{.items = static_cast<std::uint64_t>(item_ns / kernel_ns),
                  .stages = keys.stages,
                  .keys = keys.keys,
                  .rounds = bench::rounds_for(kernel_ns)};
  const Setup setup{.threads = threads, .in_flight = 65536};
  const Result expected = bench::inlined_loop(work, setup);
  const auto costs = measure({bench::inlined_loop, kCarpool, bench::waves}, work, setup, expected);
  const double loop = costs[0].cpu_ns;
  const std::string suffix = label(keys, kernel_ns, threads);
  const std::string group = suffix.substr(2);
  rows.add("loop, CPU per visit" + suffix, loop, "ns");
  rows.at_most("carpool over loop" + suffix, costs[1].cpu_ns - loop, "ns", kernel_ns < 50 ? 3 : 0);
  rows.at_most("carpool over waves of 4k" + suffix, costs[1].cpu_ns - costs[2].cpu_ns, "ns", 3);
  rows.bar(group, "carpool", costs[1].cpu_ns - loop);
  rows.bar(group, "waves of 4k", costs[2].cpu_ns - loop);
  if (rivals) {
    const auto rival = [&](const char* name, Contestant run) {
      const double cost = run_once(run, work, setup, expected).cpu_ns - loop;
      rows.add(name + (" over loop" + suffix), cost, "ns");
      rows.bar(group, name, cost);
    };
    rival("flow_graph", bench::flow_graph);
    rival("feeder", bench::feeder);
    rival("task_group", bench::task_group);
  }
}

void few_items_many_keys() {
  const Work work{.items = 20'000, .stages = 1, .keys = 1024, .rounds = bench::rounds_for(20)};
  const Setup setup{.threads = 1, .in_flight = 1000};
  const Result expected = bench::inlined_loop(work, setup);
  const auto costs = measure({bench::inlined_loop, kCarpool}, work, setup, expected, 9);
  rows.at_most("1,000 items in 1,024 keys: carpool over loop", costs[1].cpu_ns - costs[0].cpu_ns,
               "ns", 40);
}

void tables() {
  // All tables together are larger than a core's caches; one fits the first level.
  const std::uint32_t keys = 1024;
  std::vector<std::uint64_t> table(std::size_t{keys} * bench::kTableWords);
  for (std::size_t i = 0; i < table.size(); ++i) {
    table[i] = bench::mix(i);
  }
  const Work work{.items = 300'000, .stages = 1, .keys = keys, .rounds = 16, .table = &table};
  const Setup setup{.threads = 1, .in_flight = 262144};
  const Result expected = bench::inlined_loop(work, setup);
  const auto costs =
      measure({bench::inlined_loop, kCarpool, bench::waves}, work, setup, expected, 3);
  rows.at_least("32 KiB table per key: loop / carpool", costs[0].cpu_ns / costs[1].cpu_ns, "x",
                1.5);
  rows.at_least("32 KiB table per key: waves / carpool", costs[2].cpu_ns / costs[1].cpu_ns, "x",
                1.5);
}

void long_tail(double kernel_ns) {
  const Work work{
      .items = 2'000'000, .stages = 1, .rounds = bench::rounds_for(kernel_ns), .long_tail = 1000};
  const Setup setup{.threads = 2, .in_flight = 65536};
  const Result expected = bench::inlined_loop(work, setup);
  std::vector<double> idle;
  const Contestant carpool = [&](const Work& w, const Setup& s) {
    carpool::RunReport report;
    const Result result = bench::carpool_run(w, s, report);
    idle.push_back(100 * report.idle_seconds / (report.seconds * 2));
    return result;
  };
  const double ratio = wall_ratio([&] { return run_once(bench::waves, work, setup, expected); },
                                  [&] { return run_once(carpool, work, setup, expected); });
  char name[96];
  std::snprintf(name, sizeof name, "long tail, %g ns, 2 threads: ", kernel_ns);
  rows.at_least(name + std::string("waves / carpool, wall time"), ratio, "x", 1.5);
  rows.at_most(name + std::string("idle worker time"), median(idle), "%", 3);
}

void scaling() {
  const Work work{.items = 60'000, .stages = 1, .rounds = bench::rounds_for(500)};
  const Result expected = bench::inlined_loop(work, {.threads = 1});
  const auto scaled = [&](const Contestant& run) {
    return wall_ratio([&] { return run_once(run, work, {.threads = 1}, expected); },
                      [&] { return run_once(run, work, {.threads = 2}, expected); });
  };
  rows.add("2 threads / 1 thread at 500 ns: loop, which this machine allows",
           scaled(bench::inlined_loop), "x");
  rows.at_least("2 threads / 1 thread at 500 ns: carpool", scaled(kCarpool), "x", 1.9);
}

// Four times the work must not take more allocations: a slab or two at most.
void allocations() {
  Work work{.items = 50'000, .rounds = 1};
  const Setup setup{.threads = 1, .in_flight = 16384};
  const auto count = [&](std::uint64_t items) {
    work.items = items;
    const std::uint64_t before = carpool_test::allocation_count();
    bench::carpool_run(work, setup);
    return static_cast<double>(carpool_test::allocation_count() - before);
  };
  count(50'000);  // whatever is set up once per process
  const double fewer = count(50'000);
  rows.at_most("allocations: 1.6 M more item-visits take so many more", count(250'000) - fewer, "",
               8);
}

// One item in 64 out: memory stays within the formula, and what others take beside it. Before any
// thread has been started: see peak_bytes.
void fan_out(bool quick) {
  const std::uint32_t roots = quick ? 15'625 : 1'562'500;
  const char* const name = quick ? "1 in, 64 out, 1e6 items: " : "1 in, 64 out, 1e8 items: ";
  const std::size_t ours = bench::peak_bytes([&] {
    carpool::RunReport report;
    bench::carpool_fan_out(roots, 2, report);
  });
  const std::size_t theirs = bench::peak_bytes([&] { bench::flow_graph_fan_out(roots, 2); });
  rows.add(name + std::string("resident memory, carpool"), static_cast<double>(ours) / 1024, "KiB");
  rows.add(name + std::string("resident memory, flow_graph"), static_cast<double>(theirs) / 1024,
           "KiB");
}

void fan_out_formula() {
  carpool::RunReport report;
  bench::carpool_fan_out(100'000, 2, report);
  rows.at_most(
      "1 in, 64 out: peak memory of blocks and tables / formula",
      static_cast<double>(report.peak_bytes) / static_cast<double>(report.worst_case_bytes), "x",
      1);
}

// One item becomes ten million, of which nobody had been told: they go to a file, and come back.
// On one thread: a second could take them as fast as they are made.
void spilled() {
  constexpr std::uint32_t kChildren = 10'000'000;
  carpool::Graph graph;
  const auto stage = graph.add_stage<std::uint64_t>({.name = "split"});
  std::vector<Result> sums(2);
  graph.set_kernel(stage, [&](const carpool::Batch<std::uint64_t>& batch, carpool::Emitter& out) {
    for (const std::uint64_t item : batch.items) {
      sums[batch.worker].sum += item;
      for (std::uint32_t i = 0; item == 0 && i < kChildren; ++i) {
        out.emit(stage, 0, std::uint64_t{i} + 1);
      }
    }
  });
  graph.add_source({.name = "one"}, [&](carpool::SourceContext&, carpool::Emitter& out) {
    out.emit(stage, 0, std::uint64_t{0});
    return carpool::SourceStatus::exhausted;
  });
  const double begin = bench::wall_seconds();
  const carpool::RunReport report =
      carpool::run(graph, {.threads = 1, .in_flight = 16384, .overflow = carpool::Overflow::spill});
  const double seconds = bench::wall_seconds() - begin;
  if (sums[0].sum + sums[1].sum != std::uint64_t{kChildren} * (kChildren + 1) / 2) {
    std::fprintf(stderr, "bench-scheduler: spilled items were lost; this is a bug\n");
    std::exit(1);
  }
  const std::string name = "1 in, 1e7 out, undeclared, spilled: ";
  rows.at_most(
      name + "peak memory / formula",
      static_cast<double>(report.peak_bytes) / static_cast<double>(report.worst_case_bytes), "x",
      1);
  rows.add(name + "the formula", static_cast<double>(report.worst_case_bytes) / 1024, "KiB");
  rows.add(name + "the file", static_cast<double>(report.peak_spill_bytes) / 1048576, "MiB");
  rows.add(name + "wall time per item", seconds * 1e9 / kChildren, "ns");
}

// A stage that blocks: what waiting for it costs, in time of the processor.
void waiting() {
  carpool::Graph graph;
  const auto wait =
      graph.add_stage<int>({.name = "wait", .block_items = 1, .concurrency = 2, .blocking = true});
  graph.set_kernel(wait, [](const carpool::Batch<int>&, carpool::Emitter&) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  });
  int next = 0;
  graph.add_source({.name = "requests"}, [&](carpool::SourceContext&, carpool::Emitter& out) {
    out.emit(wait, 0, next);
    return ++next < 50 ? carpool::SourceStatus::more : carpool::SourceStatus::exhausted;
  });
  const double cpu = bench::cpu_seconds();
  const double wall = bench::wall_seconds();
  carpool::run(graph, {.threads = 2});
  rows.at_most("waiting for a stage that blocks: share of one core",
               100 * (bench::cpu_seconds() - cpu) / (bench::wall_seconds() - wall), "%", 1);
}

double seconds_of(const std::function<void()>& work) {
  const double begin = bench::wall_seconds();
  work();
  return bench::wall_seconds() - begin;
}

// The examples against what one would write with oneTBB alone.
void twins(bool quick) {
  const auto ratio = [&](const std::function<void()>& plain, const std::function<void()>& ours) {
    std::vector<double> ratios;
    for (int round = 0; round < 3; ++round) {  // few: these runs are long
      const double first = seconds_of(plain);
      ratios.push_back(first / seconds_of(ours));
    }
    return median(ratios);
  };
  const std::uint32_t histories = quick ? 100'000 : 10'000'000;
  const transport::Slab slab(
      {{.end = 1, .sigma = 1, .scattering = 0.9},
       {.end = std::numeric_limits<double>::infinity(), .sigma = 2, .scattering = 0.9}});
  rows.at_least("transport: parallel_reduce / carpool, wall time, 2 threads",
                ratio([&] { transport::by_history_parallel(slab, histories, 2); },
                      [&] { transport::by_event(slab, histories, 2, false); }),
                "x", 1);
  const sssp::Grid grid(quick ? 200 : 2000);
  rows.at_least("sssp: parallel_for per bucket / carpool, wall time, 2 threads",
                ratio([&] { sssp::delta_stepping_waves(grid, 2, 50); },
                      [&] { sssp::delta_stepping(grid, 2, 50); }),
                "x", 1);
  rows.add("sssp: Dijkstra / carpool, wall time, 2 threads",
           ratio([&] { sssp::dijkstra(grid); }, [&] { sssp::delta_stepping(grid, 2, 50); }), "x");
}

void costs(bool quick) {
  const Keys few{.stages = 1, .keys = 64};
  const Keys spread{.stages = 16, .keys = 4};  // as many bins, of more stages
  const Keys many{.stages = 16, .keys = 64};
  compare(20, 1, few, false, quick);
  compare(20, 1, many, !quick, quick);
  few_items_many_keys();
  if (quick) {
    return;
  }
  compare(20, 2, few, false);
  compare(20, 2, many, true);
  compare(100, 1, few, false);
  compare(100, 2, few, false);
  compare(100, 1, many, true);
  compare(100, 2, many, true);
  compare(500, 1, few, false);
  compare(500, 2, few, false);
  for (const double kernel_ns : {20.0, 100.0, 500.0}) {
    compare(kernel_ns, 1, spread, false);
    compare(kernel_ns, 2, spread, false);
  }
}

struct Group {
  const char* name;
  bool in_quick;
  std::function<void(bool quick)> measure;
};

// In this order: fan_out must come before any thread has been started.
const Group kGroups[] = {
    {"memory", true, fan_out},
    {"costs", true, costs},
    {"tables", false, [](bool) { tables(); }},
    {"tail", false,
     [](bool) {
       long_tail(20);
       long_tail(100);
     }},
    {"scaling", false, [](bool) { scaling(); }},
    {"prediction", true, [](bool quick) { bench::predict(rows, quick); }},
    {"bounds", true,
     [](bool) {
       allocations();
       fan_out_formula();
       spilled();
     }},
    {"waiting", true, [](bool) { waiting(); }},
    {"twins", true, twins},
};

bool is_group(const std::string& name) {
  return std::any_of(std::begin(kGroups), std::end(kGroups),
                     [&](const Group& group) { return group.name == name; });
}

int usage() {
  std::fprintf(stderr,
               "usage: bench-scheduler [--json FILE] [--plot FILE.svg] [--quick] [--only GROUP]\n"
               "groups:");
  for (const Group& group : kGroups) {
    std::fprintf(stderr, " %s", group.name);
  }
  std::fprintf(stderr, "\n");
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  std::string json;
  std::string plot;
  std::string only;
  bool quick = false;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--json") == 0 && i + 1 < argc) {
      json = argv[++i];
    } else if (std::strcmp(argv[i], "--plot") == 0 && i + 1 < argc) {
      plot = argv[++i];
    } else if (std::strcmp(argv[i], "--only") == 0 && i + 1 < argc && is_group(argv[i + 1])) {
      only = argv[++i];
    } else if (std::strcmp(argv[i], "--quick") == 0) {
      quick = true;
    } else {
      return usage();
    }
  }
  for (const Group& group : kGroups) {
    if (only.empty() ? group.in_quick || !quick : only == group.name) {
      group.measure(quick);
    }
  }
  for (const auto& [path, written] : {std::pair{json, json.empty() || rows.write_json(json)},
                                      std::pair{plot, plot.empty() || rows.write_plot(plot)}}) {
    if (!written) {
      std::fprintf(stderr, "bench-scheduler: cannot write %s\n", path.c_str());
      return 4;
    }
  }
  return 0;
}
