// The steps from an imported file to finished tables: textures, camera, placement, opacity, lights.
#include "render/scene/assemble.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <exception>
#include <utility>

#include "render/image/environment_read.h"
#include "render/image/texture_build.h"
#include "render/lights/environment.h"
#include "render/lights/light_tree.h"
#include "render/scene/camera.h"
#include "render/scene/emission.h"
#include "render/scene/opacity.h"

namespace carpool::render {
namespace {

using stages::SceneTables;

class Stopwatch {
 public:
  double Lap() {
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<double>(now - std::exchange(last_, now)).count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

void MakeTextures(const ImportedScene& imported, SceneTables& tables, const WarningSink& warn) {
  std::vector<EncodedImageView> images;
  for (const EncodedImage& image : imported.images) images.push_back({image.bytes, image.where});
  std::vector<TextureSourceView> sources;
  for (const TextureSource& source : imported.texture_sources)
    sources.push_back({source.image, source.srgb, source.coverage});
  BuildTextures(images, sources, tables.textures, warn);
}

void Rebase(std::vector<stages::MeshInstance>& instances, const std::array<double, 3>& origin) {
  for (stages::MeshInstance& instance : instances) {
    for (int r = 0; r < 3; ++r) instance.object_to_world[4 * r + 3] -= origin[r];
  }
}

PunctualInput ToPunctual(const PunctualLight& light, const std::array<double, 3>& origin) {
  PunctualInput input;
  constexpr stages::LightType kTypes[] = {stages::LightType::point, stages::LightType::spot,
                                          stages::LightType::directional};
  input.type = kTypes[static_cast<int>(light.type)];
  for (int r = 0; r < 3; ++r) {
    input.position[r] = static_cast<float>(light.world[4 * r + 3] - origin[r]);
    input.direction[r] = static_cast<float>(-light.world[4 * r + 2]);
    input.intensity[r] = static_cast<float>(light.color[r] * light.intensity);
  }
  input.range = static_cast<float>(light.range);
  input.inner_cone = static_cast<float>(light.inner_cone);
  input.outer_cone = static_cast<float>(light.outer_cone);
  return input;
}

/// Soft light from everywhere, a little more from above, so that shapes can be told apart.
std::vector<float> NeutralSky(int height) {
  std::vector<float> rgb;
  for (int row = 0; row < height; ++row) {
    const double up = std::cos(3.14159265358979 * (row + 0.5) / height);
    for (int c = 0; c < 3; ++c) rgb.push_back(static_cast<float>(0.7 + 0.3 * up));
  }
  return rgb;
}

bool HasOwnLight(const ImportedScene& imported, const SceneTables& tables) {
  const auto lit = [&](const PunctualLight& light) { return light.intensity > 0; };
  const auto emits = [&](const stages::Placement& p) {
    const int32_t flags = tables.materials[p.material].flags;
    return (flags & stages::kMaterialEmissive) != 0;
  };
  return std::any_of(imported.lights.begin(), imported.lights.end(), lit) ||
         std::any_of(tables.geometry.placements.begin(), tables.geometry.placements.end(), emits);
}

void LoadEnvironment(const AssembleOptions& options, PreparedScene& scene) {
  if (options.environment.empty()) return;
  EnvironmentMap image = ReadEnvironment(options.environment, options.warn);
  BuildEnvironment(scene.tables.lights.environment, image.width, image.height,
                   std::move(image.rgb));
  scene.environment_name = options.environment;
}

void LightTheUnlit(const ImportedScene& imported, const AssembleOptions& options,
                   PreparedScene& scene) {
  if (!options.environment.empty() || HasOwnLight(imported, scene.tables)) return;
  constexpr int kRows = 16;
  BuildEnvironment(scene.tables.lights.environment, 1, kRows, NeutralSky(kRows));
  scene.environment_name = "(neutral)";
  if (options.warn) {
    options.warn(imported.summary.file +
                 ": the scene has no light; using a neutral sky (--env takes another)");
  }
}

/// Runs both at once. If both fail, the error is the first one's.
template <class First, class Second>
void RunBoth(const First& first, const Second& second) {
  std::array<std::exception_ptr, 2> errors;
  const auto attempt = [&](size_t which, const auto& action) {
    try {
      action();
    } catch (...) {
      errors[which] = std::current_exception();
    }
  };
  tbb::parallel_invoke([&] { attempt(0, first); }, [&] { attempt(1, second); });
  for (const std::exception_ptr& error : errors) {
    if (error) std::rethrow_exception(error);
  }
}

std::vector<int32_t> TriangleCounts(const SceneTables& tables, const PlacementPlan& plan) {
  const stages::GeometryTables& g = tables.geometry;
  std::vector<int32_t> counts(g.placements.size());
  for (const PlacementPlan::Flat& flat : plan.flat)
    counts[flat.placement] = g.shapes[flat.shape].triangle_count;
  for (const PlacementPlan::Instanced& instance : plan.instanced) {
    const stages::Mesh& mesh = g.meshes[instance.mesh];
    for (int32_t s = 0; s < mesh.shape_count; ++s) {
      counts[instance.first_placement + s] = g.shapes[mesh.first_shape + s].triangle_count;
    }
  }
  return counts;
}

}  // namespace

PreparedScene AssembleScene(ImportedScene imported, const AssembleOptions& options) {
  PreparedScene scene;
  SceneTables& tables = scene.tables;
  Stopwatch watch;

  const CameraNode camera = ChooseCamera(imported, options.camera, options.warn);
  const auto [width, height] =
      ImageSize(camera, options.width, options.height, options.default_width);
  scene.width = width;
  scene.height = height;
  scene.camera_name = camera.name;
  tables.origin = {camera.world[3], camera.world[7], camera.world[11]};
  tables.camera = MakeCamera(camera, width, height);

  tables.materials = std::move(imported.materials);
  tables.textures.slots = std::move(imported.slots);
  RunBoth([&] { MakeTextures(imported, tables, options.warn); },
          [&] { LoadEnvironment(options, scene); });
  SimplifyOpacity(tables.materials, tables.textures, imported.geometry);
  scene.times.textures = watch.Lap();

  tables.geometry = std::move(imported.geometry);
  Rebase(tables.geometry.instances, tables.origin);
  scene.placement = PlaceInstances(tables, imported.summary.file);
  scene.times.geometry = watch.Lap();

  LightTheUnlit(imported, options, scene);
  std::vector<PunctualInput> punctual;
  for (const PunctualLight& light : imported.lights)
    punctual.push_back(ToPunctual(light, tables.origin));
  BuildLightTree(tables, CollectEmission(tables, TriangleCounts(tables, scene.placement)),
                 punctual);
  scene.times.lights = watch.Lap();
  return scene;
}

}  // namespace carpool::render
