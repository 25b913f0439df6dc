// One render from settings to files: load, plan, build, render in passes, save.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

#include "render/base/error.h"
#include "render/session/progress.h"
#include "render/session/settings.h"
#include "stages/executors/executor.h"

namespace carpool::render {

/// What a render did, for people (`Text`) and for scripts (`Json`, the content of --stats).
struct RenderSummary {
  ExitCode code =
      ExitCode::done;  // done, no (noise target missed in the time given) or interrupted
  std::string output, scene, camera, environment, executor, executor_reason, isa;
  stages::Camera view;
  std::array<double, 3> eye = {};  // where it is, metres in the file's space
  int width = 0, height = 0;
  int samples = 0;  // that every pixel has at least
  uint64_t seed = 0;
  double noise = -1;  // relative standard error, negative if unknown
  stages::SampleLedger ledger;
  double clamp = 0;  // 0: none
  stages::RayCounts rays;
  double load_seconds = 0, bvh_seconds = 0, render_seconds = 0, save_seconds = 0;
  double first_preview_seconds = -1;  // after the end of the BVH build
  uint64_t film_bytes = 0, bvh_bytes = 0, state_bytes = 0, queue_bytes = 0;
  stages::PathComparison comparison;  // of the reference executor; empty for the others
  RunReport schedule;                 // of the last pass; empty for executors without a graph

  std::string Text() const;
  std::string Json() const;
};

/// Render does what `settings` say. `stop` may be set at any time, from any thread or a signal
/// handler: rendering ends within a fraction of a second and what there is is saved. Throws Error;
/// an existing output file is then untouched.
RenderSummary Render(const RenderSettings& settings, const std::atomic<bool>& stop,
                     const ProgressSink& progress, const WarningSink& warn);

}  // namespace carpool::render
