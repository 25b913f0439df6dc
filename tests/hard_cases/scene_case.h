// A hard case as a scene: glTF built in code, the settings that render it, and its command line.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "render/session/session.h"
#include "tests/support/scene_builder.h"
#include "tests/support/statistics.h"

namespace carpool::test {

/// A lat-long environment map, rows from the top, 3 floats a texel; width 0: none.
struct Sky {
  int width = 0, height = 0;
  std::vector<float> rgb = {};
};

/// Constant radiance from everywhere.
Sky UniformSky(float radiance);

struct SceneCase {
  std::string name;  // of its file
  SceneBuilder scene = {};
  render::RenderSettings settings = {};  // paths are filled in when it is written
  Sky sky = {};
};

/// Settings that cases start from: 16x16 pixels, two threads.
render::RenderSettings HardSettings(int samples, int depth);

/// Writes the scene, and its sky if it has one, into `folder`; returns the settings with both
/// paths.
render::RenderSettings WriteCase(const SceneCase& scene, const std::filesystem::path& folder);

/// The commands that write and render it alone, with that seed.
std::string RenderCommand(const SceneCase& scene, uint64_t seed);

/// Renders a case again and again. Not thread safe.
class CaseRenderer {
 public:
  explicit CaseRenderer(const SceneCase& scene) : settings_(WriteCase(scene, folder_.path())) {}

  /// Mean of the green channel over the image, one value for each of `count` seeds.
  Mean Seeds(uint32_t first, int count) const;

 private:
  ScratchFolder folder_;
  render::RenderSettings settings_;
};

}  // namespace carpool::test
