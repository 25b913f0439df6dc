// Warns of surfaces so close in front of a light that shadow rays cannot tell them from it.
#pragma once

#include "render/base/error.h"
#include "render/scene/assemble.h"
#include "stages/tracing/trace.h"

namespace carpool::render {

/// Shadow rays stop 2^-19 (distance + largest coordinates of both ends) before a light, and before
/// the plane of a triangle 2^-20 of the distance to its farthest corner sooner, so that it never
/// shadows itself: what is nearer to it goes unseen. This looks out of the lights, of some thousand
/// of them where there are more, over what that is for the farthest receiver of the scene, and says
/// in one line what it found.
void WarnOfWallsNearLights(const PreparedScene& scene, const stages::TraceView& trace,
                           const WarningSink& warn);

}  // namespace carpool::render
