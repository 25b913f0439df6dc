// One image by every executor of the ladder, from textbook recursion to the binned stage graph,
// with what each is worth.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "render/base/error.h"
#include "render/session/settings.h"

namespace carpool::render {

struct LadderOptions {
  int rounds = 3;              ///< each rung renders this often, in turn; medians are shown
  double serial_seconds = 60;  ///< serial rungs that would take longer in all are skipped
};

/// What one rung did. Figures are medians over the rounds, or of the last round where they hardly
/// change.
struct RungResult {
  int number = 0;    ///< 1..8
  std::string name;  ///< what it adds to the rung before
  bool ran = false;
  std::string note;  ///< why it did not run
  double seconds = 0;
  double mega_rays = 0;        ///< camera, bounce and shadow rays, 10^6 per second
  double speed = 0;            ///< samples per second over those of rung 3; 0 if that did not run
  double seats_filled = 0;     ///< SIMD lanes used while shading, 0..1
  double run_length = 0;       ///< paths per call of the shading kernel
  double bubbles = 0;          ///< share of the threads' time without work, 0..1
  double state_mebibytes = 0;  ///< path state and queues
  double scheduler = -1;       ///< share of worker time, 0..1; negative where there is no scheduler
  bool identical = false;      ///< the image has the same bytes as that of the last rung
  /// Otherwise: by how much the mean luminance differs (0.1: 10 % brighter than the last rung's),
  /// and how probable a difference that large is if both had the same expectation: Welch's test,
  /// with the films' standard errors. They know nothing of lights too small to have been hit, which
  /// makes pure path tracing look dark under a hard sun.
  double difference = 0, p_value = 1;
};

struct LadderReport {
  std::string scene, isa;
  int width = 0, height = 0, samples = 0, threads = 0, rounds = 0;
  bool stopped = false;  ///< ended early; the rounds under way are left out
  std::vector<RungResult> rungs;

  std::string Text() const;  ///< a table for people
  std::string Json() const;  ///< the same as one object
  std::string Html() const;  ///< a page of its own, with bars
};

/// Renders `settings.samples` samples per pixel by each rung, in turn, `options.rounds` times.
/// Throws like Render. `stop` ends it between or within passes; `progress`, if set, is told what
/// runs next. Nothing is written.
LadderReport RunLadder(const RenderSettings& settings, const LadderOptions& options,
                       const std::atomic<bool>& stop,
                       const std::function<void(const std::string&)>& progress,
                       const WarningSink& warn);

}  // namespace carpool::render
