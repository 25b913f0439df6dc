// The light tables as raw pointers, which is how kernels take them.
#pragma once

#include "stages/tables/geometry_view.h"
#include "stages/tables/lights.h"
#include "stages/tables/scene.h"

namespace carpool::stages {

struct EnvironmentView {
  int32_t width = 0;  // 0: no environment, nothing else may be read
  int32_t height = 0;
  const float* texels = nullptr;
  const int32_t* row_cdf = nullptr;
  const int32_t* column_cdf = nullptr;
  const int32_t* row_guide = nullptr;
  const int32_t* column_guide = nullptr;
};

inline EnvironmentView ViewOf(const Environment& environment) {
  return {environment.width,
          environment.height,
          environment.texels.data(),
          environment.row_cdf.data(),
          environment.column_cdf.data(),
          environment.row_guide.data(),
          environment.column_guide.data()};
}

/// Borrows from a `SceneTables` that must outlive it and stay unchanged.
struct LightView {
  const Light* lights = nullptr;
  const LightNode* nodes = nullptr;
  const int32_t* parents = nullptr;
  const int32_t* infinite_lights = nullptr;
  int32_t node_count = 0;
  int32_t infinite_count = 0;
  int32_t uniform_count = 0;   // > 0: the tree is not asked, all so many lights are chosen alike
  float tree_probability = 0;  // see LightTables
  float infinite_probability = 0;
  float environment_probability = 0;
  EnvironmentView environment;
  GeometryView geometry;  // where triangle lights find their vertices
};

/// Is there anything that next-event estimation could choose?
inline bool HasLights(const LightView& view) {
  return view.tree_probability > 0 || view.infinite_probability > 0 ||
         view.environment_probability > 0;
}

inline LightView LightViewOf(const SceneTables& scene) {
  const LightTables& lights = scene.lights;
  LightView view;
  view.lights = lights.lights.data();
  view.nodes = lights.nodes.data();
  view.parents = lights.parents.data();
  view.infinite_lights = lights.infinite_lights.data();
  view.node_count = static_cast<int32_t>(lights.nodes.size());
  view.infinite_count = static_cast<int32_t>(lights.infinite_lights.size());
  view.tree_probability = lights.tree_probability;
  view.infinite_probability = lights.infinite_probability;
  view.environment_probability = lights.environment_probability;
  view.environment = ViewOf(lights.environment);
  view.geometry = ViewOf(scene.geometry);
  return view;
}

}  // namespace carpool::stages
