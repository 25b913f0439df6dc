// What drives the kernels: the executors' common face.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <tbb/task_arena.h>

#include "carpool/carpool.h"
#include "stages/executors/camera_work.h"
#include "stages/executors/path_comparison.h"
#include "stages/kernels/kernels.h"

namespace carpool::stages {

struct RayCounts {
  uint64_t camera = 0, bounce = 0,
           shadow = 0;  // bounce counts continued rays through transparent layers too
  uint64_t total() const { return camera + bounce + shadow; }
  RayCounts& operator+=(const RayCounts& other) {
    camera += other.camera;
    bounce += other.bounce;
    shadow += other.shadow;
    return *this;
  }
};

struct ExecutorOptions {
  tbb::task_arena* arena = nullptr;  // required; supplies the threads
  uint32_t threads = 1;
  uint64_t memory_bytes = uint64_t{64} << 20;  // for path state and queues (wavefront)
  uint32_t batch_items = 0;                    // 0: each stage's own
  Policy policy = Policy::deepest_first();
  bool bins = true;              // wavefront: false puts all materials and depths in one queue ...
  bool simd = true;              // ... and shades one lane at a time
  Trace trace = Trace(nullptr);  // records the passes (wavefront)
};

/// What one pass did.
struct PassReport {
  RayCounts rays;
  double seconds = 0;
  bool stopped = false;       // ended early: samples of some pixels of this pass are missing
  RunReport schedule;         // of the stage graph; empty for executors without one
  uint64_t state_bytes = 0;   // path state
  double run_length = 1;      // items per call of the shading kernel
  double seats_filled = 0;    // SIMD lanes used while shading / lanes of the instruction set, 0..1
  double idle_seconds = 0;    // of all threads together, without anything to do
  PathComparison comparison;  // of the reference executor; empty for the others
};

/// Renders passes into the film of its context. The samples a pass adds, and their values, do not
/// depend on executor, threads, batches or policy.
class Executor {
 public:
  virtual ~Executor() = default;
  virtual std::string_view name() const = 0;

  /// The stage graph in Graphviz's language; empty for executors without one.
  virtual std::string Dot() const = 0;

  /// Why this one drives the kernels, where that was for it to decide; else empty.
  virtual std::string Why() const { return {}; }

  /// How many paths it follows at once at most, beside one per thread: with fewer, a measurement
  /// would be of how they start and end.
  virtual uint64_t PathsInFlight() const { return 0; }

  /// Renders one pass. `stop` ends it early: no new camera rays, what is in flight comes to its
  /// end. `progress`, if set, is called now and then by some worker with the fraction done.
  virtual PassReport Render(const CameraPass& pass, const std::atomic<bool>& stop,
                            const std::function<void(double)>& progress) = 0;
};

/// All borrow `context` and `kernels`, which must outlive the executor.
std::unique_ptr<Executor> MakeWavefront(const KernelContext& context, const Kernels& kernels,
                                        std::span<const Placement> placements,
                                        const ExecutorOptions& options);
std::unique_ptr<Executor> MakeMegakernel(const KernelContext& context, const Kernels& kernels,
                                         const ExecutorOptions& options);

/// Renders by whichever candidate is fastest for this scene: the first passes are shared out among
/// them in parts, which are timed; all that follows goes to the winner. What is too short to be
/// timed goes to candidates[0]. `pixels` is how many the image has.
std::unique_ptr<Executor> MakeFastest(std::vector<std::unique_ptr<Executor>> candidates,
                                      uint64_t pixels);

/// Renders in double, path by path, and compares each path with its float self, one lane of
/// `kernels`. The image is that of double: the one executor whose bytes are its own.
std::unique_ptr<Executor> MakeReference(const KernelContext& context, const Kernels& kernels,
                                        const ExecutorOptions& options);

}  // namespace carpool::stages
