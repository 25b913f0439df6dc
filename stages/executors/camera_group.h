// Camera rays of packets: gathered for all executors; made, traced and begun for those without a
// stage graph.
#pragma once

#include <array>
#include <cstdint>

#include "stages/executors/camera_work.h"
#include "stages/kernels/kernels.h"

namespace carpool::stages {

static_assert(kCameraGroup == kGroupWidth * kGroupHeight);

/// Adds the group of `packet`, whose first pixel is in the image; the pixels outside idle.
inline void AddGroup(const KernelContext& c, const CameraPacket& packet, CameraRays& rays) {
  for (uint32_t i = 0; i < kCameraGroup; ++i) {
    const uint32_t x = packet.x + i % kGroupWidth, y = packet.y + i / kGroupWidth;
    const bool inside = x < c.width && y < c.height;
    const uint32_t place = rays.count + i;
    rays.pixel[place] = inside ? y * c.width + x : packet.y * c.width + packet.x;
    rays.sample[place] = packet.sample;
    rays.inside[place] = inside ? -1 : 0;
  }
  rays.count += kCameraGroup;
}

/// The paths of a packet whose pixel is in the image.
struct CameraGroup {
  std::array<PathState, kCameraGroup> paths;
  uint32_t count = 0;
};

/// Starts the paths of `packet`, with their first hits. It is traced as a whole, whoever asks: its
/// hits do not depend on the executor.
inline CameraGroup TraceCameraGroup(const KernelContext& c, CameraKernel camera,
                                    const CameraPacket& packet) {
  CameraRays rays;
  AddGroup(c, packet, rays);
  camera(c, rays);
  IntersectCameraRays(c.trace, rays);
  CameraGroup group;
  for (uint32_t i = 0; i < kCameraGroup; ++i) {
    if (rays.inside[i] != 0) StartPath(rays, i, group.paths[group.count++]);
  }
  return group;
}

}  // namespace carpool::stages
