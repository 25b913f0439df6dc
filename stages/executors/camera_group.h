// The camera rays of one packet, made and traced: how executors without a stage graph start paths.
#pragma once

#include <array>
#include <cstdint>

#include "stages/executors/camera_work.h"
#include "stages/kernels/kernels.h"

namespace carpool::stages {

using CameraKernel = void (*)(const KernelContext&, PathState*, std::span<const uint32_t>);

/// Which of eight consecutive slots hold the paths of a packet: those whose pixel is in the image.
struct CameraGroup {
  std::array<uint32_t, 8> slots;
  size_t count = 0;
};

/// Starts the paths of `packet` in paths[first] to paths[first + 7] and finds their first hits. The
/// packet is traced as a whole, whoever asks: its hits do not depend on the executor.
inline CameraGroup TraceCameraGroup(const KernelContext& c, CameraKernel camera,
                                    const CameraPacket& packet, PathState* paths, uint32_t first) {
  CameraGroup group;
  std::array<PathState*, 8> traced = {};
  EachPixel(packet, c.width, c.height, [&](uint32_t i, uint32_t pixel) {
    const uint32_t slot = first + i;
    paths[slot].pixel = pixel;
    paths[slot].sample = packet.sample;
    traced[i] = &paths[slot];
    group.slots[group.count++] = slot;
  });
  camera(c, paths, {group.slots.data(), group.count});
  IntersectPacket(c.trace, traced.data());
  return group;
}

}  // namespace carpool::stages
