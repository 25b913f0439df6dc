// The fixed set of scenes that the benchmark page is about.
#pragma once

#include <string>
#include <vector>

#include "tools/bench/scene_bench.h"

namespace carpool::tools {

/// `own`: the folder of this project's scenes, `models` that of glTF models by others, with
/// environment maps in env/, and `generated` that of scenes made by generate-scenes: instances.glb,
/// lights.glb and textures.glb.
std::vector<SceneCase> SuiteCases(const std::string& own, const std::string& models,
                                  const std::string& generated);

}  // namespace carpool::tools
