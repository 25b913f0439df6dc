// Follows one path and writes down what happens to it.
#include "render/session/explain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <span>

#include "render/session/workspace.h"
#include "stages/executors/camera_group.h"
#include "stages/executors/follow_path.h"
#include "stages/simd/denormals.h"

namespace carpool::render {
namespace {

using stages::PathState;
using stages::PathStep;

constexpr std::array<const char*, 3> kLobes = {"specular", "multiple scattering", "diffuse"};

std::string Format(const char* format, auto... values) {
  char line[512];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

std::string Triple(const float v[3]) {
  return Format("(%.9g, %.9g, %.9g)", v[0], v[1], v[2]);
}

/// The hit's place from its barycentrics, in double.
std::array<double, 3> HitPlace(const stages::GeometryView& g, const PathState& path) {
  const stages::Placement& p = g.placements[path.placement];
  const double weights[3] = {1.0 - path.u - path.v, path.u, path.v};
  std::array<double, 3> local = {0, 0, 0};
  for (uint32_t k = 0; k < 3; ++k) {
    const uint32_t vertex =
        g.indices[static_cast<uint32_t>(p.first_index) + 3 * path.primitive + k];
    for (size_t i = 0; i < 3; ++i)
      local[i] += weights[k] * g.vertices[static_cast<size_t>(p.first_vertex) + vertex].position[i];
  }
  std::array<double, 3> world = {0, 0, 0};
  for (size_t r = 0; r < 3; ++r) {
    const float* const row = p.object_to_world + 4 * r;
    world[r] = row[0] * local[0] + row[1] * local[1] + row[2] * local[2] + row[3];
  }
  return world;
}

class Story {
 public:
  Story(const stages::KernelContext& context, const PathState& path) : c_(context), before_(path) {
    text_ += "camera   from " + Triple(path.origin) + " towards " + Triple(path.direction) + "\n";
    Hit(path);
  }

  void Step(PathStep step, const PathState& path) {
    switch (step) {
      case PathStep::shaded:
        Shaded(path);
        break;
      case PathStep::shadowed:
        text_ += "  shadow   " + std::string(Added(path) ? "lit" : "dark") + ", radiance now " +
                 Triple(path.radiance) + "\n";
        break;
      case PathStep::traced:
        Hit(path);
        break;
      case PathStep::missed:
        text_ += "  sky      " + Emission(path);
        break;
    }
    before_ = path;
    probe_ = {};
  }

  stages::PathProbe* probe() { return &probe_; }
  const std::string& text() const { return text_; }

 private:
  bool Added(const PathState& path) const {
    return path.radiance[0] != before_.radiance[0] || path.radiance[1] != before_.radiance[1] ||
           path.radiance[2] != before_.radiance[2];
  }

  std::string Emission(const PathState& path) const {
    return Format("weight %.6g (pdf of the ray %.6g, of light sampling %.6g), radiance now ",
                  probe_.emission_weight, before_.pdf, probe_.emission_light_pdf) +
           Triple(path.radiance) + "\n";
  }

  void Hit(const PathState& path) {
    if (path.placement < 0) {
      text_ += "the ray leaves the scene\n";
      return;
    }
    const stages::Placement& placement = c_.geometry.placements[path.placement];
    const auto place = HitPlace(c_.geometry, path);
    text_ += Format("vertex %u: node %d, material %d, triangle %u at (%.6g, %.6g), %.9g along\n",
                    (path.flags & stages::kPathDepthMask) + 1, placement.object - 1,
                    placement.material, path.primitive, path.u, path.v, path.distance);
    text_ += Format("  place    (%.9g, %.9g, %.9g)\n", place[0], place[1], place[2]);
  }

  void Shaded(const PathState& path) {
    if ((path.flags & stages::kPathLayerMask) != (before_.flags & stages::kPathLayerMask) &&
        path.origin[0] == before_.origin[0] && (path.flags & stages::kPathLayerMask) != 0) {
      text_ += "  passes   straight through: transparent here, or culled\n";
      return;
    }
    if (probe_.emission_weight > 0) text_ += "  emission " + Emission(path);
    if (path.shadow_distance > 0 && probe_.light_pdf > 0) {
      text_ += Format("  light    pdf %.6g, BSDF has %.6g, weight %.6g; ", probe_.light_pdf,
                      probe_.light_bsdf_pdf, probe_.light_weight) +
               Format("shadow ray of %.9g towards ", path.shadow_distance) +
               Triple(path.shadow_direction) + " carries " + Triple(path.shadow_radiance) + "\n";
    }
    if ((path.flags & stages::kPathAlive) == 0) {
      text_ += "  ends     here\n";
      return;
    }
    Scattered(path);
  }

  void Scattered(const PathState& path) {
    const auto place = HitPlace(c_.geometry, before_);
    double offset = 0, largest = 0;
    for (size_t i = 0; i < 3; ++i) {
      offset += std::pow(path.origin[i] - place[i], 2);
      largest = std::max(largest, std::abs(place[i]));
    }
    offset = std::sqrt(offset);
    const char* const lobe = probe_.lobe >= 0 ? kLobes[static_cast<size_t>(probe_.lobe)] : "none";
    text_ += Format("  scatters by its %s lobe, pdf %.6g, towards ", lobe, path.pdf) +
             Triple(path.direction) + "\n";
    text_ += "  weight   (";
    for (int i = 0; i < 3; ++i) {
      const float before = before_.throughput[i];
      text_ += Format(i == 0 ? "%.6g" : ", %.6g", before > 0 ? path.throughput[i] / before : 0.0f);
    }
    text_ += "), throughput now " + Triple(path.throughput) + "\n";
    text_ += Format("  origin   moved %.3g off the surface, %.2g ulps of its largest coordinate\n",
                    offset, largest > 0 ? offset / (largest * 0x1p-23) : 0.0);
  }

  const stages::KernelContext& c_;
  PathState before_;
  stages::PathProbe probe_;
  std::string text_;
};

}  // namespace

std::string ExplainSample(const RenderSettings& settings, const SampleName& name,
                          const WarningSink& warn) {
  CheckSettings(settings);
  Threads threads(settings.threads);
  std::string text;
  threads.arena().execute([&] {
    Workspace workspace(LoadScene(settings, warn), settings, threads);
    stages::KernelContext context = workspace.context();
    const auto x = static_cast<uint32_t>(name.x), y = static_cast<uint32_t>(name.y);
    if (x >= context.width || y >= context.height) {
      throw Error(ExitCode::usage, "--pixel: " + std::to_string(name.x) + "," +
                                       std::to_string(name.y) + " is outside the image of " +
                                       std::to_string(context.width) + "x" +
                                       std::to_string(context.height) + " pixels");
    }
    const stages::FlushDenormals denormals;
    stages::CameraGroup group =
        TraceCameraGroup(context, workspace.kernels().wide.camera,
                         {x / stages::kGroupWidth * stages::kGroupWidth,
                          y / stages::kGroupHeight * stages::kGroupHeight, name.sample});
    PathState& path = *std::ranges::find(std::span(group.paths).first(group.count),
                                         y * context.width + x, &PathState::pixel);
    Story story(context, path);
    context.probe = story.probe();
    const stages::OpacityQuery opacity{&context, workspace.kernels().opacity};
    FollowPath(context, workspace.kernels().one, opacity, path,
               [&](PathStep step, const PathState& now) { story.Step(step, now); });
    text = story.text() + "sample   " + Triple(path.radiance) + "\n";
  });
  return text;
}

}  // namespace carpool::render
