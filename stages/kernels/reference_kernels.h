// The kernels in double, one path at a time: the same templates as kernels.h lists, as the
// reference that float is compared with.
#pragma once

#include <cstdint>

#include "stages/kernels/kernels.h"
#include "stages/tables/reference_path.h"

namespace carpool::stages {

// All of these run with floating-point traps on (stages/simd/float_traps.h): an invalid operation,
// a division by zero or an overflow raises SIGFPE.

/// Starts the path: pixel and sample are set, the rest is written.
void ReferenceCamera(const KernelContext& c, ReferencePath& path);

/// Shades a surface hit; where the path goes next.
Next ReferenceShade(const KernelContext& c, ReferencePath& path);

/// Adds the environment to a path that left the scene.
void ReferenceMiss(const KernelContext& c, ReferencePath& path);

/// Coverage of a possibly transparent material, for shadow rays.
float ReferenceOpacity(const void* context, int32_t placement, uint32_t primitive, float u,
                       float v);

/// Where the path's ray meets the plane of the triangle that it is known to hit: u, v and distance
/// in double from the vertices, as near to (u, v) as the triangle reaches. Seen edge on, the hit
/// stays as it was.
void RefineHit(const KernelContext& c, ReferencePath& path);

}  // namespace carpool::stages
