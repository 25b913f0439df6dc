// Short rays out of lights.
#include "render/session/near_walls.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "stages/simd/denormals.h"

namespace carpool::render {
namespace {

using Point = std::array<double, 3>;
using stages::Light;
using stages::LightType;

constexpr size_t kLightsLookedAt = 4096;

Point operator+(const Point& a, const Point& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
Point operator-(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Point operator*(double s, const Point& a) {
  return {s * a[0], s * a[1], s * a[2]};
}
Point Cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double Length(const Point& a) {
  return std::hypot(a[0], a[1], a[2]);
}

Point PointAt(const float p[3]) {
  return {p[0], p[1], p[2]};
}

/// The largest coordinate of anything in the scene.
double Extent(const stages::TraceView& trace) {
  double extent = 0;
  for (const RTCScene level : {trace.opaque.scene, trace.transparent.scene}) {
    if (level == nullptr) continue;
    RTCBounds b;
    rtcGetSceneBounds(level, &b);
    for (const float x : {b.lower_x, b.lower_y, b.lower_z, b.upper_x, b.upper_y, b.upper_z})
      extent = std::max(extent, std::abs(double{x}));
  }
  return extent;
}

/// Distance to what stands within `reach` of `from` along `direction`; infinity if nothing does.
/// `left`, a triangle light, is not met.
double Nearest(const stages::TraceView& trace, const Point& from, const Point& direction,
               const Light* left, double reach) {
  stages::PathState path = {};
  for (size_t i = 0; i < 3; ++i) {
    path.origin[i] = static_cast<float>(from[i]);
    path.direction[i] = static_cast<float>(direction[i]);
  }
  path.placement = left != nullptr ? left->placement : stages::kNone;
  path.primitive = left != nullptr ? static_cast<uint32_t>(left->primitive) : 0;
  stages::IntersectPath(trace, path);
  return path.placement != stages::kNone && path.distance <= reach
             ? double{path.distance}
             : std::numeric_limits<double>::infinity();
}

double NearestOfTriangle(const stages::TraceView& trace, const Light& light, double reach) {
  const Point a = PointAt(light.triangle.p0), b = PointAt(light.triangle.p1),
              c = PointAt(light.triangle.p2);
  Point normal = Cross(b - a, c - a);
  if (!(Length(normal) > 0)) return std::numeric_limits<double>::infinity();
  normal = (light.type == LightType::mirrored_triangle ? -1 : 1) / Length(normal) * normal;
  const Point third = 1.0 / 3 * (a + b + c);
  double nearest = std::numeric_limits<double>::infinity();
  for (const Point& from : {third, 0.5 * (third + a), 0.5 * (third + b), 0.5 * (third + c)}) {
    nearest = std::min(nearest, Nearest(trace, from, normal, &light, reach));
    if (light.type == LightType::two_sided_triangle)
      nearest = std::min(nearest, Nearest(trace, from, -1.0 * normal, &light, reach));
  }
  return nearest;
}

double NearestOfPoint(const stages::TraceView& trace, const Light& light, double reach) {
  const Point from = PointAt(light.punctual.position);
  double nearest = std::numeric_limits<double>::infinity();
  for (const double x : {-1.0, 0.0, 1.0}) {
    for (const double y : {-1.0, 0.0, 1.0}) {
      for (const double z : {-1.0, 0.0, 1.0}) {
        const Point way = {x, y, z};
        if (Length(way) > 0)
          nearest = std::min(nearest, Nearest(trace, from, 1 / Length(way) * way, nullptr, reach));
      }
    }
  }
  return nearest;
}

}  // namespace

void WarnOfWallsNearLights(const PreparedScene& scene, const stages::TraceView& trace,
                           const WarningSink& warn) {
  const stages::HugeVector<Light>& lights = scene.tables.lights.lights;
  if (!warn || lights.empty()) return;
  const stages::FlushDenormals denormals;
  // The farthest receiver is twice the extent times sqrt(3) away, with coordinates of the extent;
  // half the distance again is for the plane of a triangle.
  const double reach = 0x1p-19 * (3 * std::sqrt(3.0) + 2) * Extent(trace);
  const size_t step = (lights.size() + kLightsLookedAt - 1) / kLightsLookedAt;
  size_t looked_at = 0, hidden = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < lights.size(); i += step) {
    const Light& light = lights[i];
    if (light.type == LightType::directional) continue;
    const double distance = IsTriangle(light.type) ? NearestOfTriangle(trace, light, reach)
                                                   : NearestOfPoint(trace, light, reach);
    ++looked_at;
    if (distance > reach) continue;
    ++hidden;
    nearest = std::min(nearest, distance);
  }
  if (hidden == 0) return;
  char line[256];
  std::snprintf(line, sizeof line,
                "%zu of %zu lights looked at have a surface closer in front of them than shadow "
                "rays can tell (%.2g m; up to %.2g m go unseen from afar): they may shine through "
                "it; move it away or remove the light",
                hidden, looked_at, nearest, reach);
  warn(line);
}

}  // namespace carpool::render
