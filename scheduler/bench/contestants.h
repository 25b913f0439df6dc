// The contestants: this scheduler, the inlined loop, and what oneTBB offers.
#pragma once

#include "workload.h"

namespace bench {

struct Setup {
  int threads = 1;
  std::uint64_t in_flight = 65536;
};

// Each does the whole work and returns the sum over all items.
Result inlined_loop(const Work& work, const Setup& setup);
Result carpool_run(const Work& work, const Setup& setup);
Result waves(const Work& work, const Setup& setup);
Result flow_graph(const Work& work, const Setup& setup);
Result feeder(const Work& work, const Setup& setup);
Result task_group(const Work& work, const Setup& setup);

}  // namespace bench
