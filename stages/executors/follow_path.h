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

/// Follows a path whose ray has been traced to its end; `observe(step, path)` hears of each step.
/// The path's radiance is then its sample.
template <class Observe>
void FollowPath(const KernelContext& c, const KernelSet& kernels, const OpacityQuery& opacity,
                PathState& path, Observe&& observe) {
  const uint32_t slot = 0;
  const std::span<const uint32_t> slots(&slot, 1);
  for (;;) {
    if (path.placement < 0) {
      kernels.miss(c, &path, slots);
      observe(PathStep::missed, path);
      return;
    }
    Next next = Next::film;
    kernels.shade(c, &path, slots, &next);
    observe(PathStep::shaded, path);
    if (next == Next::shadow) {
      TraceShadow(c.trace, opacity, path);
      observe(PathStep::shadowed, path);
      next = (path.flags & kPathAlive) != 0 ? Next::trace : Next::film;
    }
    if (next == Next::film) return;
    IntersectPath(c.trace, path);
    observe(PathStep::traced, path);
  }
}

}  // namespace carpool::stages
