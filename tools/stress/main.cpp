// carpool-stress: random graphs under random settings until the time is up, without any renderer.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <map>
#include <string>

#include <tbb/global_control.h>

#include <CLI/CLI.hpp>

#include "trial.h"

namespace {

using carpool_stress::Findings;
using carpool_stress::Sabotage;
using carpool_stress::Scenario;

struct Arguments {
  double seconds = 10;
  std::uint64_t seed = 1;
  std::uint64_t runs = std::numeric_limits<std::uint64_t>::max();
  bool repeat = false;
  double hang_seconds = 120;
  Sabotage sabotage = Sabotage::none;
};

// Worst is the largest value seen, and where.
struct Worst {
  const char* what;
  const char* unit;
  double value = 0;
  std::uint64_t seed = 0;

  void note(double seen, std::uint64_t at) {
    if (seen > value) {
      value = seen;
      seed = at;
    }
  }
  void print() const {
    if (seed != 0) {
      std::printf("  %-52s %10.3f %-8s seed %llu\n", what, value, unit,
                  static_cast<unsigned long long>(seed));
    }
  }
};

// Summary adds up what all trials found.
class Summary {
 public:
  void add(const Scenario& scenario, const Findings& findings) {
    const std::uint64_t seed = scenario.seed;
    ++runs_;
    simulated_ += scenario.simulated() ? 1 : 0;
    visits_ += findings.visits;
    slowest_.note(findings.seconds * 1e3, seed);
    memory_.note(findings.memory_share, seed);
    measured_.note(findings.measured_share, seed);
    late_.note(findings.late_batches, seed);
    cancel_.note(findings.cancel_seconds * 1e3, seed);
    idle_.note(findings.idle_cpu_share, seed);
  }

  std::uint64_t runs() const { return runs_; }

  void print(double seconds, std::uint64_t first_seed) const {
    std::printf(
        "%llu runs, %llu of them simulated, from seed %llu, in %.1f s: %.0f runs/s, %.2f M "
        "item-visits/s\nworst cases:\n",
        static_cast<unsigned long long>(runs_), static_cast<unsigned long long>(simulated_),
        static_cast<unsigned long long>(first_seed), seconds, static_cast<double>(runs_) / seconds,
        static_cast<double>(visits_) / seconds * 1e-6);
    for (const Worst* worst : {&slowest_, &memory_, &measured_, &late_, &cancel_, &idle_}) {
      worst->print();
    }
  }

 private:
  std::uint64_t runs_ = 0;
  std::uint64_t simulated_ = 0;
  std::uint64_t visits_ = 0;
  Worst slowest_{"slowest run", "ms"};
  Worst memory_{"reported memory / formula", "x"};
  Worst measured_{"memory from operator new / formula and fixed parts", "x"};
  Worst late_{"calls begun after cancel() had returned", ""};
  Worst cancel_{"from cancel() to the return of run()", "ms"};
  Worst idle_{"time used while nobody had work", "cores"};
};

// Returns what a shell should get.
int stress(const Arguments& arguments) {
  using Clock = std::chrono::steady_clock;
  const tbb::global_control many(tbb::global_control::max_allowed_parallelism, 64);
  carpool_stress::Watchdog watchdog{std::chrono::duration<double>(arguments.hang_seconds)};
  carpool_stress::TrialRunner trials(watchdog, arguments.sabotage);
  Summary summary;
  const Clock::time_point begin = Clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  std::string failure;
  std::uint64_t seed = arguments.seed;
  while (failure.empty() && summary.runs() < arguments.runs && seconds() < arguments.seconds) {
    const Scenario scenario = carpool_stress::scenario_of(seed);
    try {
      summary.add(scenario, trials.run(scenario));
    } catch (const carpool_stress::Failure& broken) {
      failure = broken.what();
    }
    seed += arguments.repeat ? 0 : 1;
  }
  summary.print(seconds(), arguments.seed);
  if (failure.empty()) {
    std::printf("all good\n");
    return 0;
  }
  std::fprintf(stderr, "carpool-stress: %s\n", failure.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App program("Random graphs under random settings, in simulation and on threads.",
                   "carpool-stress");
  program.add_option("--seconds", arguments.seconds, "how long")->check(CLI::PositiveNumber);
  program.add_option("--seed", arguments.seed, "the first seed; even ones are simulated");
  program.add_option("--runs", arguments.runs, "the most runs");
  program.add_flag("--repeat", arguments.repeat, "use the first seed again and again");
  program.add_option("--hang", arguments.hang_seconds, "a run that takes so many seconds hangs")
      ->check(CLI::PositiveNumber);
  const std::map<std::string, Sabotage> mistakes{{"lose-item", Sabotage::lose_item},
                                                 {"late-call", Sabotage::late_call},
                                                 {"hang", Sabotage::hang}};
  program.add_option("--sabotage", arguments.sabotage, "make a mistake, which must be found")
      ->transform(CLI::CheckedTransformer(mistakes));
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {
      return program.exit(error);  // --help
    }
    std::fprintf(stderr, "carpool-stress: %s; see carpool-stress --help\n", error.what());
    return 2;
  }
  return stress(arguments);
}
