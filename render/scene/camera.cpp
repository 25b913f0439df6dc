// Camera choice, framing, projection.
#include "render/scene/camera.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <vector>

namespace carpool::render {
namespace {

using Vec3 = std::array<double, 3>;

Vec3 Column(const Affine& m, int c) {
  return {m[c], m[4 + c], m[8 + c]};
}
Vec3 Cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vec3 Normalized(const Vec3& a, const Vec3& fallback) {
  const double length = std::hypot(a[0], a[1], a[2]);
  if (!(length > 0) || !std::isfinite(length)) return fallback;
  return {a[0] / length, a[1] / length, a[2] / length};
}

struct Bounds {
  Vec3 low, high;
  bool empty = true;
  void Add(const Vec3& p) {
    for (int i = 0; i < 3; ++i) {
      low[i] = empty ? p[i] : std::min(low[i], p[i]);
      high[i] = empty ? p[i] : std::max(high[i], p[i]);
    }
    empty = false;
  }
};

Bounds ShapeBounds(const stages::GeometryTables& g, const stages::Shape& shape) {
  Bounds bounds;
  for (int32_t v = 0; v < shape.vertex_count; ++v) {
    const float* const p = g.vertices[static_cast<size_t>(shape.first_vertex) + v].position;
    bounds.Add({p[0], p[1], p[2]});
  }
  return bounds;
}

Bounds SceneBounds(const ImportedScene& scene) {
  const stages::GeometryTables& g = scene.geometry;
  std::vector<Bounds> shapes;
  for (const stages::Shape& shape : g.shapes) shapes.push_back(ShapeBounds(g, shape));
  Bounds all;
  for (const stages::MeshInstance& instance : g.instances) {
    const stages::Mesh& mesh = g.meshes[instance.mesh];
    const Affine& m = instance.object_to_world;
    for (int32_t s = 0; s < mesh.shape_count; ++s) {
      const Bounds& b = shapes[mesh.first_shape + s];
      if (b.empty) continue;
      for (int corner = 0; corner < 8; ++corner) {
        const Vec3 p = {(corner & 1) != 0 ? b.high[0] : b.low[0],
                        (corner & 2) != 0 ? b.high[1] : b.low[1],
                        (corner & 4) != 0 ? b.high[2] : b.low[2]};
        Vec3 q;
        for (int r = 0; r < 3; ++r)
          q[r] = m[4 * r] * p[0] + m[4 * r + 1] * p[1] + m[4 * r + 2] * p[2] + m[4 * r + 3];
        all.Add(q);
      }
    }
  }
  return all;
}

/// Looks at the middle of everything from the front, a little from the right and above.
CameraNode FramingCamera(const ImportedScene& scene) {
  constexpr double kFieldOfView = 0.7;  // radians, about 40 degrees
  Bounds bounds = SceneBounds(scene);
  if (bounds.empty) bounds.Add({0, 0, 0});
  Vec3 center, extent;
  for (int i = 0; i < 3; ++i) {
    center[i] = 0.5 * (bounds.low[i] + bounds.high[i]);
    extent[i] = bounds.high[i] - bounds.low[i];
  }
  double radius = 0.5 * std::hypot(extent[0], extent[1], extent[2]);
  if (!(radius > 0)) radius = 1;
  const Vec3 back = Normalized({0.4, 0.3, 1}, {0, 0, 1});
  const Vec3 right = Normalized(Cross({0, 1, 0}, back), {1, 0, 0});
  const Vec3 up = Cross(back, right);
  const double distance = 1.02 * radius / std::sin(0.5 * kFieldOfView);
  CameraNode camera;
  camera.name = "(framing)";
  camera.yfov = kFieldOfView;
  for (int r = 0; r < 3; ++r) {
    camera.world[4 * r] = right[r];
    camera.world[4 * r + 1] = up[r];
    camera.world[4 * r + 2] = back[r];
    camera.world[4 * r + 3] = center[r] + distance * back[r];
  }
  return camera;
}

std::string ListCameras(const ImportedScene& scene) {
  std::string list;
  for (size_t i = 0; i < scene.cameras.size(); ++i) {
    list += (i == 0 ? "" : ", ") + std::to_string(i) + " (" + scene.cameras[i].name + ")";
  }
  return list.empty() ? "none" : list;
}

}  // namespace

CameraNode ChooseCamera(const ImportedScene& scene, const std::string& wanted,
                        const WarningSink& warn) {
  if (wanted.empty()) {
    if (!scene.cameras.empty()) return scene.cameras.front();
    if (warn)
      warn(scene.summary.file + ": the scene has no camera; using one that frames everything");
    return FramingCamera(scene);
  }
  for (const CameraNode& camera : scene.cameras) {
    if (camera.name == wanted || camera.camera_name == wanted) return camera;
  }
  size_t index = 0;
  const char* const end = wanted.data() + wanted.size();
  const auto [stop, error] = std::from_chars(wanted.data(), end, index);
  if (error == std::errc() && stop == end && index < scene.cameras.size())
    return scene.cameras[index];
  throw InputError(scene.summary.file, "there is no camera '" + wanted +
                                           "'; --camera takes one of: " + ListCameras(scene));
}

std::array<int, 2> ImageSize(const CameraNode& camera, int width, int height, int default_width) {
  if (width > 0 && height > 0) return {width, height};
  double aspect = 16.0 / 9.0;
  if (camera.orthographic && camera.ymag != 0 && camera.xmag != 0)
    aspect = std::abs(camera.xmag / camera.ymag);
  if (!camera.orthographic && camera.aspect > 0) aspect = camera.aspect;
  const double rows = std::round(default_width / aspect);
  return {default_width, static_cast<int>(std::clamp(rows, 1.0, 16.0 * default_width))};
}

stages::Camera MakeCamera(const CameraNode& camera, int width, int height) {
  const Vec3 back = Normalized(Column(camera.world, 2), {0, 0, 1});
  const Vec3 up_hint = Normalized(Column(camera.world, 1), {0, 1, 0});
  const Vec3 right = Normalized(Cross(up_hint, back), {1, 0, 0});
  const Vec3 up = Cross(back, right);
  stages::Camera record;
  for (int r = 0; r < 3; ++r) {
    record.world_from_camera[4 * r] = static_cast<float>(right[r]);
    record.world_from_camera[4 * r + 1] = static_cast<float>(up[r]);
    record.world_from_camera[4 * r + 2] = static_cast<float>(back[r]);
    record.world_from_camera[4 * r + 3] = 0;
  }
  const double aspect = static_cast<double>(width) / height;
  record.orthographic = camera.orthographic ? 1 : 0;
  if (camera.orthographic) {
    // The wider of the two magnifications holds, so that nothing the file wants to be seen is cut
    // off.
    const double half_height = std::max(std::abs(camera.ymag), std::abs(camera.xmag) / aspect);
    record.half_height = static_cast<float>(half_height);
    record.half_width = static_cast<float>(half_height * aspect);
  } else {
    record.half_height = static_cast<float>(std::tan(0.5 * camera.yfov));
    record.half_width = static_cast<float>(std::tan(0.5 * camera.yfov) * aspect);
  }
  return record;
}

}  // namespace carpool::render
