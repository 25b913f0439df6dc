// A case loaded as a render would: tables, BVH and one-lane kernels, for rows about single rays.
#pragma once

#include <array>
#include <random>

#include "render/session/workspace.h"
#include "stages/simd/denormals.h"
#include "tests/hard_cases/scene_case.h"

namespace carpool::test {

class LoadedCase {
 public:
  explicit LoadedCase(const SceneCase& scene)
      : settings_(WriteCase(scene, folder_.path())),
        threads_(settings_.threads),
        workspace_(render::LoadScene(settings_, {}), settings_, threads_) {}

  const stages::KernelContext& context() const { return workspace_.context(); }

  /// The first thing that a ray meets, as the path's last hit.
  void Trace(stages::PathState& path) const { stages::IntersectPath(context().trace, path); }

  /// Shades the path's hit; where it goes next.
  stages::Next Shade(stages::PathState& path) const {
    const uint32_t slot = 0;
    stages::Next next = stages::Next::film;
    workspace_.kernels().one.shade(context(), &path, {&slot, 1}, &next);
    return next;
  }

  /// Corner `k` of a triangle of a flat placement, in double.
  Point Corner(int32_t placement, uint32_t primitive, uint32_t k) const {
    const stages::GeometryView& g = context().geometry;
    const stages::Placement& p = g.placements[placement];
    const uint32_t vertex = g.indices[static_cast<uint32_t>(p.first_index) + 3 * primitive + k];
    const float* const at = g.vertices[static_cast<size_t>(p.first_vertex) + vertex].position;
    return {at[0], at[1], at[2]};
  }

 private:
  ScratchFolder folder_;
  render::RenderSettings settings_;
  render::Threads threads_;
  render::Workspace workspace_;
  stages::FlushDenormals denormals_;
};

inline Point operator+(const Point& a, const Point& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Point operator-(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Point operator*(double s, const Point& a) {
  return {s * a[0], s * a[1], s * a[2]};
}
inline double Dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Point Cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double Length(const Point& a) {
  return std::sqrt(Dot(a, a));
}

/// A point of the unit sphere.
inline Point RandomDirection(std::mt19937& rng) {
  std::normal_distribution<double> normal;
  Point p;
  do {
    p = {normal(rng), normal(rng), normal(rng)};
  } while (Length(p) < 1e-3);
  return 1 / Length(p) * p;
}

/// A path that has bounced once already, with its ray from `origin` along `direction`.
inline stages::PathState RayFrom(const Point& origin, const Point& direction, uint32_t sample) {
  stages::PathState path = {};
  for (int i = 0; i < 3; ++i) {
    path.origin[i] = static_cast<float>(origin[i]);
    path.direction[i] = static_cast<float>(direction[i]);
    path.throughput[i] = 1;
  }
  path.pdf = 1;
  path.flags = 1;
  path.sample = sample;
  path.placement = stages::kNone;  // it leaves no triangle
  return path;
}

}  // namespace carpool::test
