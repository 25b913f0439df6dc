// The contestants: this scheduler, the inlined loop, and what oneTBB offers.
#pragma once

#include "carpool/run.h"
#include "machine_costs.h"
#include "workload.h"

namespace bench {

struct Setup {
  int threads = 1;
  std::uint64_t in_flight = 65536;
  const carpool::Simulation* simulation = nullptr;  // play the run instead, carpool only
  std::uint32_t flush_count = 0;                    // see carpool::FlushOptions, carpool only
};

// Each does the whole work and returns the sum over all items.
Result inlined_loop(const Work& work, const Setup& setup);
Result carpool_run(const Work& work, const Setup& setup);
Result carpool_run(const Work& work, const Setup& setup, carpool::RunReport& report);
Result waves(const Work& work, const Setup& setup);
Result flow_graph(const Work& work, const Setup& setup);
Result feeder(const Work& work, const Setup& setup);
Result task_group(const Work& work, const Setup& setup);

// Items that read a piece of the table each, wherever it lies.
std::uint64_t carpool_read(const BigTable& table, std::uint64_t items, const Setup& setup,
                           carpool::RunReport& report);

// Roots that become 64 leaves each; returns the sum over all leaves.
std::uint64_t carpool_fan_out(std::uint32_t roots, int threads, carpool::RunReport& report);
std::uint64_t flow_graph_fan_out(std::uint32_t roots, int threads);

}  // namespace bench
