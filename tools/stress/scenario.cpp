// Draws scenarios from seeds.
#include "scenario.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "random_settings.h"

namespace carpool_stress {
namespace {

using carpool_test::mix;

// Dice gives independent numbers for one seed.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(mix(seed * 7 + 3)) {}
  std::uint64_t roll(std::uint64_t sides) { return mix(state_ += 0x9e3779b97f4a7c15ULL) % sides; }
  bool one_in(std::uint64_t sides) { return roll(sides) == 0; }

 private:
  std::uint64_t state_;
};

Ending random_ending(Dice& dice, bool simulated) {
  static constexpr std::array kEarly{
      Ending::kernel_throws,   Ending::all_throw,     Ending::source_throws, Ending::policy_throws,
      Ending::progress_throws, Ending::cancel_inside, Ending::drain,         Ending::deadline};
  if (!simulated && dice.one_in(24)) {
    return Ending::cancel_outside;
  }
  if (!simulated && dice.one_in(48)) {
    return Ending::idle;
  }
  return dice.one_in(2) ? Ending::whole : kEarly[dice.roll(kEarly.size())];
}

Company random_company(Dice& dice, bool simulated) {
  switch (dice.roll(10)) {
    case 0:
      return Company::nested_loop;
    case 1:
      return Company::nested_run;
    case 2:
      return simulated ? Company::alone : Company::second_run;
    default:
      return Company::alone;
  }
}

// Threads are few as often as many; many more than there are cores.
std::uint32_t random_threads(Dice& dice, bool simulated) {
  static constexpr std::array<std::uint32_t, 4> kThreads{2, 4, 16, 64};
  static constexpr std::array<std::uint32_t, 4> kSimulated{3, 10, 60, 250};
  const std::uint64_t most = (simulated ? kSimulated : kThreads)[dice.roll(4)];
  return static_cast<std::uint32_t>(1 + dice.roll(most));
}

// Extremes that random_shape() and random_options() do not reach.
void exaggerate(Scenario& scenario, Dice& dice) {
  carpool_test::Shape& shape = scenario.shape;
  carpool::RunOptions& options = scenario.options;
  if (dice.one_in(40)) {
    shape.most_bins = 65'536;
    shape.stages = 1 + static_cast<std::uint32_t>(dice.roll(2));
    options.threads = std::min(options.threads, 6U);  // tables grow with bins times workers
  }
  if (dice.one_in(6)) {  // one item of a source may use up all credits
    options.in_flight = 2 + dice.roll(dice.one_in(4) ? 3000 : 60);
    shape.fan_out = static_cast<std::uint32_t>(options.in_flight);
    shape.items = std::max(3U, 3000 / shape.fan_out);
    shape.explicit_weights = false;  // any stage may be the one that splits
  }
  if (shape.ping_pong) {  // few items, to and fro for a long time
    shape.fan_out = 1;
    shape.items = 1 + static_cast<std::uint32_t>(dice.roll(40));
    shape.most_hops = 400;
  }
  options.in_flight = std::max<std::uint64_t>(options.in_flight, shape.fan_out);
  if (dice.one_in(10)) {  // nobody has said how many items there will be
    shape.undeclared = true;
    options.overflow = carpool::Overflow::spill;
    options.in_flight = 2 + dice.roll(60);
  }
}

}  // namespace

const char* to_string(Ending ending) {
  static constexpr std::array kNames{"whole",
                                     "a kernel throws",
                                     "all kernels throw",
                                     "a source throws",
                                     "a policy throws",
                                     "progress throws",
                                     "cancelled by a kernel",
                                     "cancelled from outside",
                                     "drained",
                                     "deadline",
                                     "idle"};
  return kNames[static_cast<std::size_t>(ending)];
}

const char* to_string(Company company) {
  static constexpr std::array kNames{"alone", "with nested loops", "with nested runs",
                                     "beside a second run"};
  return kNames[static_cast<std::size_t>(company)];
}

std::string Scenario::description() const {
  char text[400];
  std::snprintf(text, sizeof text,
                "%u %s, %u stages of up to %u bins, blocks of %u, %u sources of %u items, "
                "%u hops, fan-out %u, %llu credits, policy %s; %s, %s",
                options.threads, simulated() ? "simulated workers" : "threads", shape.stages,
                shape.most_bins, shape.block_items, shape.sources, shape.items, shape.most_hops,
                shape.fan_out, static_cast<unsigned long long>(options.in_flight),
                options.policy.name().c_str(), to_string(company), to_string(ending));
  return text;
}

Scenario scenario_of(std::uint64_t seed) {
  const bool simulated = seed % 2 == 0;
  Dice dice(seed);
  Scenario scenario{.seed = seed,
                    .shape = carpool_test::random_shape(seed),
                    .options = carpool_test::random_options(seed, random_threads(dice, simulated)),
                    .ending = random_ending(dice, simulated),
                    .company = random_company(dice, simulated),
                    .moment = dice.one_in(2) ? dice.roll(60) : dice.roll(5)};
  exaggerate(scenario, dice);
  if (simulated) {
    scenario.shape.sleeping = false;  // time is virtual there
    carpool::Simulation& simulation = scenario.options.simulation;
    scenario.options.mode = carpool::RunMode::simulated;
    simulation.seed = seed;
    // Waking takes between no time and longer than the whole run.
    simulation.wake_seconds = 1e-7 * static_cast<double>(1ULL << dice.roll(14));
    simulation.jitter = dice.one_in(4) ? 1.0 : 0.5;
  }
  if (scenario.ending == Ending::idle) {
    scenario.company = Company::alone;  // another run would not be idle
  }
  return scenario;
}

}  // namespace carpool_stress
