// Records all rays of a render and replays them through bare Embree: the speed that no renderer can
// beat.
#pragma once

#include <vector>

#include "stages/executors/executor.h"

namespace carpool::tools {

struct RecordedRay {
  float origin[3];
  float direction[3];
  float tnear, tfar;
};

/// Rays of one pass in the order of waves: all camera rays of a window of paths, their shadow rays,
/// their bounces, and so on.
struct RayLog {
  std::vector<stages::CameraRays> camera;
  uint64_t samples = 0;  // camera rays
  std::vector<RecordedRay> bounce, shadow;
  uint64_t total() const { return samples + bounce.size() + shadow.size(); }
};

/// Follows every path of samples [0, samples) with the kernels of `set`, on the calling thread.
RayLog RecordRays(const stages::KernelContext& context, const stages::Kernels& kernels,
                  uint32_t samples);

struct ReplayWay {
  bool packets;  // bounce and shadow rays: as wide as the machine has them, else one by one
  bool sorted;   // ... by direction octant and Morton code of the origin, in windows of 256k
};

/// Seconds to replay on the threads of `arena`, with the sorting; camera rays always as coherent
/// packets.
double Replay(const stages::TraceView& view, const RayLog& log, const ReplayWay& way,
              tbb::task_arena& arena);

}  // namespace carpool::tools
