// One path from its camera ray to its end, stage after stage, from the one-lane kernels.
#pragma once

#include <cstdint>
#include <span>

#include "stages/kernels/kernels.h"

namespace carpool::stages {

/// What has just happened to a path.
enum class PathStep : uint8_t {
  shaded,    // a hit was shaded; shadow_* hold the shadow ray, if there is one
  shadowed,  // the shadow ray was traced
  traced,    // the next ray was traced
  missed,    // the ray had left the scene
};

/// Where the one path that is followed is.
inline constexpr uint32_t kOnlySlot = 0;

/// The stages of one path, from the float kernels.
struct KernelSteps {
  const KernelContext& c;
  const KernelSet& kernels;
  const OpacityQuery& opacity;

  void Miss(PathState& path) const { kernels.miss(c, &path, {&kOnlySlot, 1}); }
  Next Shade(PathState& path) const {
    Next next = Next::film;
    kernels.shade(c, &path, {&kOnlySlot, 1}, &next);
    return next;
  }
  void Shadow(PathState& path) const { TraceShadow(c.trace, opacity, path); }
  void Trace(PathState& path) const { IntersectPath(c.trace, path); }
};

/// Follows a path whose ray has been traced to its end; `observe(step, path)` hears of each step.
/// The path's radiance is then its sample. `steps` are the stages, in whatever precision.
template <class Steps, class Path, class Observe>
void FollowPath(Steps&& steps, Path& path, Observe&& observe) {
  for (;;) {
    if (path.placement < 0) {
      steps.Miss(path);
      observe(PathStep::missed, path);
      return;
    }
    Next next = steps.Shade(path);
    observe(PathStep::shaded, path);
    if (next == Next::shadow) {
      steps.Shadow(path);
      observe(PathStep::shadowed, path);
      next = (path.flags & kPathAlive) != 0 ? Next::trace : Next::film;
    }
    if (next == Next::film) return;
    steps.Trace(path);
    observe(PathStep::traced, path);
  }
}

template <class Observe>
void FollowPath(const KernelContext& c, const KernelSet& kernels, const OpacityQuery& opacity,
                PathState& path, Observe&& observe) {
  FollowPath(KernelSteps{c, kernels, opacity}, path, observe);
}

}  // namespace carpool::stages
