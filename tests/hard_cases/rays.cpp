// Spheres to leak from, triangles to scatter off.
#include "tests/hard_cases/rays.h"

#include <algorithm>
#include <cmath>

namespace carpool::test {

using stages::PathState;

SceneCase FarSphere(double radius, double offset) {
  SceneCase c{.name = "sphere"};
  SceneBuilder& b = c.scene;
  b.PlaceMesh(b.AddSphere(radius, 200, b.AddLambert({0.5, 0.5, 0.5}), true),
              {offset, offset, offset});
  b.AddCamera({0, 0, 0}, 1);
  c.settings = HardSettings(1, 1);
  return c;
}

uint64_t CountLeaks(const LoadedCase& scene, double radius, double offset, uint64_t rays) {
  std::mt19937 rng(1);
  std::uniform_real_distribution<double> unit(0, 1);
  uint64_t leaks = 0;
  for (uint64_t i = 0; i < rays; ++i) {
    const Point inside = 0.6 * radius * std::cbrt(unit(rng)) * RandomDirection(rng);
    PathState ray = RayFrom(Point{offset, offset, offset} + inside, RandomDirection(rng), 0);
    scene.Trace(ray);
    leaks += ray.placement < 0;
  }
  return leaks;
}

SceneCase Soup(double size, double offset, bool needles) {
  SceneCase c{.name = "soup"};
  SceneBuilder& b = c.scene;
  std::mt19937 rng(3);
  std::vector<Point> points;
  std::vector<uint32_t> indices;
  const Point center = offset / std::sqrt(3.0) * Point{1, 1, 1};
  for (uint32_t i = 0; i < 300; ++i) {
    const Point at = center + 3 * size * RandomDirection(rng);
    const Point along = RandomDirection(rng);
    points.push_back(at);
    points.push_back(at + size * along);
    points.push_back(needles ? at + 0.5 * size * along + 1e-4 * size * RandomDirection(rng)
                             : at + size * RandomDirection(rng));
    for (int k = 0; k < 3; ++k) indices.push_back(3 * i + static_cast<uint32_t>(k));
  }
  b.PlaceMesh(b.AddMesh(points, indices, b.AddLambert({0.8, 0.8, 0.8})));
  b.AddCamera({0, 0, 0}, 1);
  c.settings = HardSettings(1, 8);
  return c;
}

namespace {

/// Position error: 10 ulps (of 2^-24) of the largest coordinate in each axis; the normal's length
/// in the 1-norm is at most sqrt 3, and each component moves by one ulp more.
double StatedBound(const LoadedCase& scene, const PathState& hit) {
  Point most = {0, 0, 0};
  for (uint32_t k = 0; k < 3; ++k) {
    const Point p = scene.Corner(hit.placement, hit.primitive, k);
    for (int i = 0; i < 3; ++i) most[i] = std::max(most[i], std::abs(p[i]));
  }
  const double offset = std::sqrt(3.0) * 10 * 0x1p-24 * std::max({most[0], most[1], most[2]});
  return offset + 10 * 0x1p-24 * Length(most) + 0x1p-23 * Length(most) + 1e-30;
}

void Scatter(const LoadedCase& scene, double size, std::mt19937& rng, uint32_t sample,
             Scattered& result) {
  std::uniform_real_distribution<double> unit(0, 1);
  const uint32_t target = static_cast<uint32_t>(rng() % 300);
  const Point p0 = scene.Corner(0, target, 0), e1 = scene.Corner(0, target, 1) - p0,
              e2 = scene.Corner(0, target, 2) - p0;
  double u = unit(rng), v = unit(rng);
  if (u + v > 1) u = 1 - u, v = 1 - v;
  const Point point = p0 + u * e1 + v * e2;
  const Point direction = RandomDirection(rng);
  PathState path = RayFrom(point - size * unit(rng) * direction, direction, sample);
  scene.Trace(path);
  if (path.placement < 0) return;
  const PathState hit = path;
  if (scene.Shade(path) != stages::Next::trace) return;

  const Point q0 = scene.Corner(hit.placement, hit.primitive, 0),
              f1 = scene.Corner(hit.placement, hit.primitive, 1) - q0,
              f2 = scene.Corner(hit.placement, hit.primitive, 2) - q0;
  const Point exact = q0 + hit.u * f1 + hit.v * f2;
  const Point origin = {path.origin[0], path.origin[1], path.origin[2]};
  const Point went = {path.direction[0], path.direction[1], path.direction[2]};
  const Point normal = Cross(f1, f2);
  ++result.rays;
  result.worst_offset =
      std::max(result.worst_offset, Length(origin - exact) / StatedBound(scene, hit));
  result.wrong_side += Dot(origin - q0, normal) * Dot(went, normal) < 0;
  scene.Trace(path);
  result.self_hits += path.placement == hit.placement && path.primitive == hit.primitive;
}

}  // namespace

Scattered ScatterAll(const LoadedCase& soup, double size, uint32_t rays) {
  std::mt19937 rng(4);
  Scattered result;
  for (uint32_t i = 0; i < rays; ++i) Scatter(soup, size, rng, i, result);
  return result;
}

}  // namespace carpool::test
