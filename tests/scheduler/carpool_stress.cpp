// carpool-stress: random graphs under random settings until the time is up, without any renderer.
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <thread>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include "random_graph.h"
#include "random_settings.h"

namespace {

using carpool_test::mix;
using carpool_test::RandomGraph;

// What the watchdog prints when a run does not end.
std::atomic<std::uint64_t> current_seed{0};
std::atomic<std::uint64_t> runs{0};
std::atomic<bool> finished{false};

using Failure = std::runtime_error;

void require(bool condition, const char* what) {
  if (!condition) {
    throw Failure(what);
  }
}

enum class Trouble { none, exception, cancel, deadline, nested, two_at_once };

Trouble trouble_of(std::uint64_t dice) {
  switch (dice % 12) {
    case 0:
      return Trouble::exception;
    case 1:
      return Trouble::cancel;
    case 2:
      return Trouble::deadline;
    case 3:
      return Trouble::nested;
    case 4:
      return Trouble::two_at_once;
    default:
      return Trouble::none;
  }
}

void check_whole_run(RandomGraph& random, const carpool::RunOptions& options) {
  const carpool::RunReport report = carpool::run(random.graph(), options);
  random.forbid_calls();
  require(report.outcome == carpool::Outcome::completed, "the run did not complete");
  require(random.counted() == random.expected(), "items were lost or handled twice");
  require(report.peak_bytes <= report.worst_case_bytes, "memory above the formula");
  require(random.late_calls() == 0, "a kernel ran after run() had returned");
}

void check_exception(RandomGraph& random, const carpool::RunOptions& options, std::uint64_t dice) {
  std::atomic<std::uint64_t> left{dice % 50};
  std::atomic<bool> thrown{false};
  random.on_batch = [&] {
    if (left.fetch_sub(1) == 0) {
      thrown = true;
      throw dice;
    }
  };
  bool arrived = false;
  try {
    carpool::run(random.graph(), options);
  } catch (std::uint64_t value) {
    arrived = value == dice;
  }
  random.forbid_calls();
  require(arrived == thrown.load(), "an exception got lost");
  require(random.late_calls() == 0, "a kernel ran after run() had thrown");
}

void check_early_end(RandomGraph& random, carpool::RunOptions options, std::uint64_t dice,
                     Trouble trouble) {
  options.cancel = carpool::CancelToken();
  std::atomic<std::uint64_t> left{dice % 50};
  if (trouble == Trouble::deadline) {
    options.deadline = std::chrono::steady_clock::now() + std::chrono::microseconds(dice % 2000);
  } else {
    random.on_batch = [&] {
      if (left.fetch_sub(1) == 0) {
        dice % 3 == 0 ? options.cancel.drain() : options.cancel.cancel();
      }
    };
  }
  const carpool::RunReport report = carpool::run(random.graph(), options);
  random.forbid_calls();
  require(report.outcome != carpool::Outcome::completed || random.counted() == random.expected(),
          "a run that says it completed did not");
  require(report.outcome != carpool::Outcome::drained || report.dropped_items == 0,
          "a drained run dropped items");
  require(random.late_calls() == 0, "a kernel ran after run() had returned");
}

void try_seed(std::uint64_t seed, bool simulate) {
  const std::uint64_t dice = mix(seed * 7 + 3);
  const auto threads = static_cast<std::uint32_t>(1 + dice % (simulate ? 200 : 32));
  carpool::RunOptions options = carpool_test::random_options(seed, threads);
  const Trouble trouble = trouble_of(dice >> 16);
  if (simulate) {
    options.mode = carpool::RunMode::simulated;
    options.simulation.seed = seed;
    options.simulation.wake_seconds = 1e-7 * static_cast<double>(1ULL << (dice >> 40) % 14);
  }
  RandomGraph random(carpool_test::random_shape(seed));
  switch (trouble) {
    case Trouble::exception:
      return check_exception(random, options, dice >> 24);
    case Trouble::cancel:
    case Trouble::deadline:
      return check_early_end(random, options, dice >> 24, trouble);
    case Trouble::nested:
      random.on_batch = [] { tbb::parallel_for(0, 4, [](int) {}); };
      return check_whole_run(random, options);
    case Trouble::two_at_once: {
      tbb::task_arena arena(static_cast<int>(threads));
      RandomGraph other(carpool_test::random_shape(seed + 1'000'000));
      carpool::RunOptions shared = options;
      shared.threads = 0;
      shared.arena = &arena;
      std::string failure;
      std::thread second([&] {
        try {
          check_whole_run(other, shared);
        } catch (const std::exception& bad) {
          failure = bad.what();
        }
      });
      try {
        check_whole_run(random, simulate ? options : shared);
      } catch (...) {
        second.join();
        throw;
      }
      second.join();
      require(failure.empty(), failure.c_str());
      return;
    }
    case Trouble::none:
      return check_whole_run(random, options);
  }
}

// Ends the program when a run takes a minute: nothing here takes longer than a few seconds.
void watch() {
  std::uint64_t seen = ~std::uint64_t{0};
  int same = 0;
  while (!finished) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    same = runs == seen ? same + 1 : 0;
    seen = runs;
    if (same > 600) {
      std::fprintf(stderr,
                   "carpool-stress: the run with seed %llu hangs; replay: carpool-stress --seed "
                   "%llu --runs 1\n",
                   static_cast<unsigned long long>(current_seed),
                   static_cast<unsigned long long>(current_seed));
      std::abort();
    }
  }
}

struct Arguments {
  double seconds = 10;
  std::uint64_t seed = 1;
  std::uint64_t most_runs = ~std::uint64_t{0};
  bool good = true;
};

Arguments parse(int argc, char** argv) {
  Arguments arguments;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--seconds") == 0) {
      arguments.seconds = std::atof(argv[i + 1]);
    } else if (std::strcmp(argv[i], "--seed") == 0) {
      arguments.seed = std::strtoull(argv[i + 1], nullptr, 10);
    } else if (std::strcmp(argv[i], "--runs") == 0) {
      arguments.most_runs = std::strtoull(argv[i + 1], nullptr, 10);
    } else {
      arguments.good = false;
    }
  }
  arguments.good = arguments.good && argc % 2 == 1;
  return arguments;
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments = parse(argc, argv);
  if (!arguments.good) {
    std::fprintf(stderr, "usage: carpool-stress [--seconds S] [--seed N] [--runs N]\n");
    return 2;
  }
  const tbb::global_control many(tbb::global_control::max_allowed_parallelism, 64);
  const auto end =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(arguments.seconds);
  std::thread watchdog(watch);
  std::uint64_t seed = arguments.seed;
  int status = 0;
  while (status == 0 && runs < arguments.most_runs && std::chrono::steady_clock::now() < end) {
    current_seed = seed;
    try {
      try_seed(seed, seed % 2 == 0);
      ++seed;
    } catch (const std::exception& failure) {
      std::fprintf(stderr,
                   "carpool-stress: seed %llu: %s; replay: carpool-stress --seed %llu --runs 1\n",
                   static_cast<unsigned long long>(seed), failure.what(),
                   static_cast<unsigned long long>(seed));
      status = 1;
    }
    ++runs;
  }
  finished = true;
  watchdog.join();
  std::printf("%llu runs, seeds %llu to %llu, half of them simulated: %s\n",
              static_cast<unsigned long long>(runs),
              static_cast<unsigned long long>(arguments.seed),
              static_cast<unsigned long long>(seed), status == 0 ? "all good" : "FAILED");
  return status;
}
