// What carpool-stress does with one seed: which graph, which settings, what goes wrong on purpose.
#pragma once

#include <cstdint>
#include <string>

#include "carpool/carpool.h"
#include "random_graph.h"

namespace carpool_stress {

// How a run is made to end.
enum class Ending {
  whole,            // it is left alone
  kernel_throws,    // one kernel call throws
  all_throw,        // from some moment on, all of them do
  source_throws,    // one source call throws
  policy_throws,    // one call of the user's policy throws
  progress_throws,  // one progress callback throws
  cancel_inside,    // a kernel cancels
  cancel_outside,   // a thread of its own cancels
  drain,            // a kernel drains
  deadline,         // a deadline passes
  idle,             // a kernel sleeps until nobody else is at work, and measures what that costs
};
const char* to_string(Ending ending);

// What happens beside or inside the run.
enum class Company {
  alone,
  nested_loop,  // kernels run a tbb::parallel_for
  nested_run,   // kernels run other graphs
  second_run,   // another graph runs in the same arena at the same time
};
const char* to_string(Company company);

struct Scenario {
  std::uint64_t seed = 1;
  carpool_test::Shape shape;
  carpool::RunOptions options;
  Ending ending = Ending::whole;
  Company company = Company::alone;
  std::uint64_t moment = 0;  // how many calls pass before the ending happens

  bool simulated() const { return options.mode == carpool::RunMode::simulated; }
  // One line for people.
  std::string description() const;
};

// scenario_of is a pure function. Even seeds are simulated, odd ones run on threads.
Scenario scenario_of(std::uint64_t seed);

}  // namespace carpool_stress
