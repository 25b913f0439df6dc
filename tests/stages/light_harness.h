// Runs any light kernel over arrays of queries, at every width and SIMD target of the machine.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "stages/tables/light_view.h"

namespace carpool::stages {

enum class LightKernel {
  look_up_environment,  // dir -> radiance, pdf (EnvironmentRadiance and EnvironmentPdf must agree)
  sample_environment,   // u -> wi, radiance, pdf
  pick_light,           // position, normal, u_pick -> light, pdf, u
  pick_probability,     // position, normal, light -> pdf
  sample_triangle,      // p, position, u -> b, wi, distance, pdf
  triangle_pdf,         // p, position, dir, distance -> pdf
  sample_light,         // position, normal, u_pick, u -> everything
  triangle_hit_pdf,     // position, normal, light, p, dir, distance -> pdf
  environment_hit_pdf,  // dir -> pdf
  triangle_vertices,  // placement, primitive -> wi, radiance, normal: the vertices; delta: mirrored
};

struct LightQuery {
  float position[3] = {0, 0, 0};
  float normal[3] = {0, 0, 0};
  float dir[3] = {0, 1, 0};
  float distance = 1;
  float p[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0};
  float u_pick = 0.5f;
  float u[2] = {0.5f, 0.5f};
  int32_t light = 0;
  int32_t placement = 0;
  int32_t primitive = 0;
};

struct LightResult {
  float wi[3];
  float radiance[3];
  float third[3];  // third vertex
  float distance;
  float pdf;
  float b[2];
  float u;
  int32_t light;
  int32_t delta;

  bool operator==(const LightResult&) const = default;
};

/// One instantiation of the kernels.
struct LightRunner {
  std::string name;  // target and width, e.g. "AVX2 x1"
  std::string target;
  std::function<std::vector<LightResult>(LightKernel, const LightView&,
                                         const std::vector<LightQuery>&)>
      run;
};

/// The widest and the one-lane instantiation of each target this machine has, in pairs.
std::vector<LightRunner> AllLightRunners();

/// The widest of the best target, for tests of what does not depend on it.
LightRunner BestLightRunner();

}  // namespace carpool::stages
