// The camera as the ray generation kernel reads it.
#pragma once

#include <cstdint>

namespace carpool::stages {

/// World-from-camera is relative to `SceneTables::origin`; the camera looks along its -Z, +Y up.
struct Camera {
  int32_t orthographic = 0;
  float world_from_camera[12] = {1, 0, 0, 0, 0, 1,
                                 0, 0, 0, 0, 1, 0};  // 3x4, row-major, orthonormal axes
  float half_width = 0.5f;   // perspective: tangent of half the horizontal field of view;
  float half_height = 0.5f;  // orthographic: half the extent in metres
};

}  // namespace carpool::stages
