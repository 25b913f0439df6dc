// Brings an imported file, its images and its surroundings together into the tables that the
// kernels read.
#pragma once

#include <string>
#include <vector>

#include "render/gltf/gltf.h"
#include "render/scene/placement.h"
#include "stages/tables/scene.h"

namespace carpool::render {

struct AssembleOptions {
  std::string camera;       // name or index; empty: the first
  std::string environment;  // .exr or .hdr lat-long file; empty: none, or a neutral one in a scene
                            // without light
  int width = 0, height = 0;  // 0: by the camera's aspect
  int default_width = 1280;
  WarningSink warn;  // may be called from several threads at once
};

/// Seconds that each step of loading took. An environment map is read beside the textures and
/// counts there.
struct LoadTimes {
  double import = 0, textures = 0, geometry = 0, lights = 0;
};

struct PreparedScene {
  stages::SceneTables tables;
  PlacementPlan placement;
  int width = 0, height = 0;
  std::string camera_name;
  std::string environment_name;  // empty: none
  LoadTimes times;
};

/// Consumes `imported`. Throws InputError for a bad image, environment or camera name.
PreparedScene AssembleScene(ImportedScene imported, const AssembleOptions& options);

}  // namespace carpool::render
