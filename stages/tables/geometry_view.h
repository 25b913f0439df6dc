// The geometry tables as raw pointers, which is how kernels take them.
#pragma once

#include "stages/tables/geometry.h"

namespace carpool::stages {

/// Borrows from a `GeometryTables` that must outlive it and stay unchanged.
struct GeometryView {
  const Placement* placements = nullptr;
  const MeshVertex* vertices = nullptr;
  const float* floats = nullptr;
  const uint32_t* indices = nullptr;
};

inline GeometryView ViewOf(const GeometryTables& tables) {
  return {tables.placements.data(), tables.vertices.data(), tables.floats.data(),
          tables.indices.data()};
}

}  // namespace carpool::stages
