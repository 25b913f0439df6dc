// Instantiates the kernels for one lane of double.
#define CARPOOL_ONE_DOUBLE

#include "stages/kernels/reference_kernels.h"

#include <algorithm>
#include <cmath>

#include "stages/kernels/camera-inl.h"
#include "stages/kernels/shade-inl.h"
#include "stages/simd/float_traps.h"

namespace carpool::stages {
namespace N_DOUBLE {
namespace {

constexpr hn::OneDouble kTag;
using Vector = Vec3<hn::OneDouble>;

Vector VectorOf(const double v[3]) {
  return {{v[0]}, {v[1]}, {v[2]}};
}
void StoreVector(const Vector& v, double to[3]) {
  to[0] = v.x.v;
  to[1] = v.y.v;
  to[2] = v.z.v;
}

/// Barycentrics and distance where `direction` from `origin` meets the plane of `t`; false if it
/// runs along the plane.
bool MeetPlaneOf(const Triangle<hn::OneDouble>& t, const Vector& origin, const Vector& direction,
                 double& u, double& v, double& distance) {
  const Vector e1 = Sub(t.p1, t.p0), e2 = Sub(t.p2, t.p0), from = Sub(origin, t.p0);
  const Vector normal = Cross(e1, e2);
  const double across = Dot(direction, normal).v;
  const double least = 1e-12 * std::sqrt(Dot(normal, normal).v * Dot(direction, direction).v);
  if (!(std::abs(across) > least)) return false;
  const Vector side = Cross(from, direction);
  u = -Dot(e2, side).v / across;
  v = Dot(e1, side).v / across;
  distance = -Dot(from, normal).v / across;
  return true;
}

}  // namespace

void Refine(const KernelContext& c, ReferencePath& path) {
  const Triangle<hn::OneDouble> t =
      TriangleVertices(kTag, c.geometry, {static_cast<int32_t>(path.placement)},
                       hn::Lane<int32_t>{static_cast<int32_t>(path.primitive)});
  const Vector origin = VectorOf(path.origin), direction = VectorOf(path.direction);
  double u, v, distance;
  if (!MeetPlaneOf(t, origin, direction, u, v, distance)) return;
  path.u = std::clamp(u, 0.0, 1.0);
  path.v = std::clamp(v, 0.0, 1 - path.u);
  path.distance = distance;
}

void StartCamera(const KernelContext& c, ReferencePath& path) {
  const auto name = [](uint64_t v) { return hn::Lane<uint32_t>{static_cast<uint32_t>(v)}; };
  const CameraRay<hn::OneDouble> ray = MakeCameraRay(kTag, c, name(path.pixel), name(path.sample));
  const CameraCone cone = ConeOf(c);
  StoreVector(ray.origin, path.origin);
  StoreVector(ray.direction, path.direction);
  std::fill_n(path.throughput, 3, 1.0);
  std::fill_n(path.radiance, 3, 0.0);
  path.tnear = path.pdf = path.shadow_distance = 0;
  path.cone_width = cone.width;
  path.cone_spread = cone.spread;
  path.flags = 0;
}

}  // namespace N_DOUBLE

void ReferenceCamera(const KernelContext& c, ReferencePath& path) {
  const FloatTraps traps;
  N_DOUBLE::StartCamera(c, path);
}

Next ReferenceShade(const KernelContext& c, ReferencePath& path) {
  const FloatTraps traps;
  Next next = Next::film;
  N_DOUBLE::ShadeLanes(N_DOUBLE::kTag, c, N_DOUBLE::OnlyPath(N_DOUBLE::kTag, &path), &next);
  return next;
}

void ReferenceMiss(const KernelContext& c, ReferencePath& path) {
  const FloatTraps traps;
  N_DOUBLE::MissLanes(N_DOUBLE::kTag, c, N_DOUBLE::OnlyPath(N_DOUBLE::kTag, &path));
}

float ReferenceOpacity(const void* context, int32_t placement, uint32_t primitive, float u,
                       float v) {
  const FloatTraps traps;
  const KernelContext& c = *static_cast<const KernelContext*>(context);
  return static_cast<float>(
      N_DOUBLE::PointOpacity(N_DOUBLE::kTag, c, placement, primitive, u, v).v);
}

void RefineHit(const KernelContext& c, ReferencePath& path) {
  const FloatTraps traps;
  N_DOUBLE::Refine(c, path);
}

}  // namespace carpool::stages
