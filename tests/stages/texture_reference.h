// A plain scalar texture look-up in double, written apart from the kernel and only for its tests.
#pragma once

#include <array>

#include "stages/tables/materials.h"

namespace carpool::stages {

/// One look-up: the arguments of `SampleTexture` for one lane.
struct TextureQuery {
  int32_t slot = 0;
  float u = 0, v = 0;
  float log2_footprint = -100;
  float u_level = 0.5f;
};

struct ReferenceSample {
  std::array<double, 4> rgba{};
  /// Distance to the nearest discrete decision (texel of nearest filtering in texels, level in
  /// levels, chance): below about 1e-3 float rounding may decide otherwise.
  double margin = 1;
};

ReferenceSample SampleReference(const TextureTables& tables, const TextureQuery& query);

}  // namespace carpool::stages
