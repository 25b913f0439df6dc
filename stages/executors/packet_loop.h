// Workers that take camera packets until none is left: how executors without a stage graph share a
// pass.
#pragma once

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <chrono>

#include "stages/executors/busy_clock.h"
#include "stages/executors/executor.h"
#include "stages/simd/denormals.h"

namespace carpool::stages {

/// Calls `visit(packet, tally)` for each packet of the pass, with a `Tally` for each thread, and
/// then `gather(tally, report)` for each of those. Returns what else there is to say of the pass.
template <class Tally, class Visit, class Gather>
PassReport RunPackets(const KernelContext& c, const ExecutorOptions& options,
                      const CameraPass& pass, const std::atomic<bool>& stop,
                      const std::function<void(double)>& progress, Visit visit, Gather gather) {
  const auto begin = std::chrono::steady_clock::now();
  CameraWork work(c.width, c.height, pass, options.threads);
  tbb::enumerable_thread_specific<Tally> tallies;
  std::atomic<bool> reporting{false};
  BusyClock clock(options.threads);

  // Each body keeps claiming some samples of a tile until none is left: dynamic balance, no
  // barrier.
  const auto worker = [&](uint32_t index) {
    const FlushDenormals denormals;
    const BusyClock::Scope busy(clock);
    Tally& tally = tallies.local();
    bool more = true;
    while (more && !stop.load(std::memory_order_relaxed)) {
      more = work.Claim(index, kClaim, [&](const CameraPacket& p) { visit(p, tally); });
      if (progress && !reporting.exchange(true, std::memory_order_acquire)) {
        progress(work.Fraction());
        reporting.store(false, std::memory_order_release);
      }
    }
  };
  options.arena->execute([&] { tbb::parallel_for(uint32_t{0}, options.threads, worker); });

  PassReport report;
  for (const Tally& tally : tallies) gather(tally, report);
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  report.stopped = work.Fraction() < 1;
  report.idle_seconds = clock.Idle(report.seconds);
  return report;
}

}  // namespace carpool::stages
