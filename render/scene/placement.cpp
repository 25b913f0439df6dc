// Baking and instancing of meshes, with transforms in double until the last rounding.
#include "render/scene/placement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <unordered_map>

#include "render/base/error.h"

namespace carpool::render {
namespace {

using stages::kNone;
using stages::Mesh;
using stages::MeshInstance;
using stages::Placement;
using stages::SceneTables;
using stages::Shape;
using Matrix = std::array<double, 12>;

// Copying this many triangles costs less than a second BVH level does.
constexpr uint64_t kCopyTriangles = 200'000;
constexpr size_t kMostElements = std::numeric_limits<int32_t>::max();

double Determinant(const Matrix& m) {
  return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
         m[2] * (m[4] * m[9] - m[5] * m[8]);
}

// Cofactors times the sign of the determinant: takes normals along without dividing by anything.
std::array<double, 9> NormalMatrix(const Matrix& m) {
  const double sign = Determinant(m) < 0 ? -1 : 1;
  const auto cofactor = [&](int r, int c) {
    const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
    return sign * (m[4 * r1 + c1] * m[4 * r2 + c2] - m[4 * r1 + c2] * m[4 * r2 + c1]);
  };
  std::array<double, 9> n;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) n[3 * r + c] = cofactor(r, c);
  }
  return n;
}

// Fewer than two independent axes: all triangles have zero area.
bool Vanishes(const Matrix& m) {
  for (const double value : NormalMatrix(m)) {
    if (value != 0) return false;
  }
  return true;
}

void TransformPoint(const Matrix& m, const float in[3], float out[3]) {
  const double x = in[0], y = in[1], z = in[2];
  for (int r = 0; r < 3; ++r) {
    out[r] = static_cast<float>(m[4 * r] * x + m[4 * r + 1] * y + m[4 * r + 2] * z + m[4 * r + 3]);
  }
}

// Through a 3x3 matrix, normalised; a vanishing direction becomes zero, which readers replace by
// the triangle's.
void TransformDirection(const std::array<double, 9>& m, const float in[3], float out[3]) {
  double d[3], length = 0;
  for (int r = 0; r < 3; ++r) {
    d[r] = m[3 * r] * in[0] + m[3 * r + 1] * in[1] + m[3 * r + 2] * in[2];
    length += d[r] * d[r];
  }
  length = std::sqrt(length);
  for (int r = 0; r < 3; ++r) out[r] = length > 0 ? static_cast<float>(d[r] / length) : 0.0f;
}

class Placer {
 public:
  Placer(SceneTables& scene, const std::string& where) : g_(scene.geometry), where_(where) {
    uses_.resize(g_.meshes.size());
    for (const MeshInstance& instance : g_.instances) ++uses_[instance.mesh];
    for (const Shape& shape : g_.shapes) {
      ++vertex_users_[shape.first_vertex];
      if (shape.tangents != kNone) ++tangent_users_[shape.tangents];
      ++index_users_[shape.first_index];
    }
  }

  PlacementPlan Run() {
    Reserve();
    for (const MeshInstance& instance : g_.instances) {
      if (Vanishes(instance.object_to_world)) continue;
      if (IsFlat(instance)) {
        PlaceFlat(instance);
      } else {
        PlaceInstanced(instance);
      }
    }
    g_.floats.resize(g_.floats.size() + kFloatsBehind, 0.0f);
    g_.indices.resize(g_.indices.size() + kIndicesBehind, 0);
    return plan_;
  }

 private:
  // Embree and kernels load 16 bytes at a vertex, also at the last one; kernels do so at a
  // triangle.
  static constexpr size_t kFloatsBehind = 4, kIndicesBehind = 1;

  // Room for all copies of streams at once: these tables are large, and each move touches new
  // pages.
  void Reserve() {
    size_t vertices = g_.vertices.size();
    size_t floats = g_.floats.size() + kFloatsBehind;
    size_t indices = g_.indices.size() + kIndicesBehind;
    for (const MeshInstance& instance : g_.instances) {
      if (Vanishes(instance.object_to_world) || !IsFlat(instance)) continue;
      const Mesh& mesh = g_.meshes[instance.mesh];
      for (int32_t s = 0; s < mesh.shape_count; ++s) {
        const Shape& shape = g_.shapes[mesh.first_shape + s];
        if (BakesInPlace(instance, shape)) continue;
        vertices += static_cast<size_t>(shape.vertex_count);
        if (shape.tangents != kNone) floats += size_t{4} * shape.vertex_count;
        if (Determinant(instance.object_to_world) < 0) indices += size_t{3} * shape.triangle_count;
      }
    }
    if (vertices > stages::kMostVertices || floats > kMostElements || indices > kMostElements) {
      throw InputError(where_,
                       "the scene has more than 2^28 vertices or 2^31 other values of them; split "
                       "it or use fewer copies");
    }
    g_.vertices.reserve(vertices);
    g_.floats.reserve(floats);
    g_.indices.reserve(indices);
  }

  bool IsFlat(const MeshInstance& instance) const {
    const bool singular = Determinant(instance.object_to_world) == 0;  // Embree cannot invert it
    return uses_[instance.mesh] == 1 || singular || Copied(instance.mesh);
  }
  bool BakesInPlace(const MeshInstance& instance, const Shape& shape) const {
    return uses_[instance.mesh] == 1 && OwnsStreams(shape);
  }
  uint64_t Triangles(const Mesh& mesh) const {
    uint64_t count = 0;
    for (int32_t s = 0; s < mesh.shape_count; ++s)
      count += g_.shapes[mesh.first_shape + s].triangle_count;
    return count;
  }
  // Streams may be overwritten with world-space values when nobody else reads them.
  bool OwnsStreams(const Shape& shape) const {
    return vertex_users_.at(shape.first_vertex) == 1 && index_users_.at(shape.first_index) == 1 &&
           (shape.tangents == kNone || tangent_users_.at(shape.tangents) == 1);
  }
  bool Copied(int32_t mesh) const {
    return Triangles(g_.meshes[mesh]) * uses_[mesh] <= kCopyTriangles;
  }

  Placement MakePlacement(const Shape& shape, int32_t object) const {
    Placement p;
    p.first_index = shape.first_index;
    p.first_vertex = shape.first_vertex;
    p.flags = shape.smooth ? stages::kPlacementSmooth : 0;
    p.tangents = shape.tangents;
    p.uv_sets = shape.uv_sets;
    p.more_uvs = shape.more_uvs;
    p.colors = shape.colors;
    p.material = shape.material;
    p.object = object;
    return p;
  }

  // Room for `count` more elements in a stream; its offset.
  template <class T>
  int32_t Extend(stages::UnsetHugeVector<T>& stream, size_t count) {
    const size_t offset = stream.size();
    stream.resize(offset + count);
    return static_cast<int32_t>(offset);
  }

  void PlaceFlat(const MeshInstance& instance) {
    const Mesh mesh = g_.meshes[instance.mesh];
    for (int32_t s = 0; s < mesh.shape_count; ++s) {
      const int32_t index = mesh.first_shape + s;
      const Shape shape = g_.shapes[index];
      Placement p = MakePlacement(shape, instance.object);
      Bake(shape, instance.object_to_world, BakesInPlace(instance, shape), p);
      plan_.flat.push_back({static_cast<int32_t>(g_.placements.size()), index});
      plan_.flat_triangles += shape.triangle_count;
      g_.placements.push_back(p);
    }
  }

  void Bake(const Shape& shape, const Matrix& m, bool in_place, Placement& p) {
    const int32_t n = shape.vertex_count;
    const bool mirrored = Determinant(m) < 0;
    if (!in_place) {
      p.first_vertex = Extend(g_.vertices, static_cast<size_t>(n));
      if (shape.tangents != kNone) p.tangents = Extend(g_.floats, size_t{4} * n);
    }
    BakeVertices(shape, m, &g_.vertices[p.first_vertex]);
    if (shape.tangents != kNone) BakeTangents(shape, m, mirrored, &g_.floats[p.tangents]);
    if (mirrored) FlipWinding(shape, in_place, p);
  }

  void BakeVertices(const Shape& shape, const Matrix& m, stages::MeshVertex* out) const {
    const stages::MeshVertex* const in = &g_.vertices[shape.first_vertex];
    const std::array<double, 9> normal_matrix = NormalMatrix(m);
    for (int32_t v = 0; v < shape.vertex_count; ++v) {
      out[v] = in[v];
      TransformPoint(m, in[v].position, out[v].position);
      if (shape.smooth) TransformDirection(normal_matrix, in[v].normal, out[v].normal);
    }
  }

  void BakeTangents(const Shape& shape, const Matrix& m, bool mirrored, float* out) const {
    const float* in = &g_.floats[shape.tangents];
    const std::array<double, 9> linear = {m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]};
    for (int32_t v = 0; v < shape.vertex_count; ++v, in += 4, out += 4) {
      TransformDirection(linear, in, out);
      out[3] = mirrored ? -in[3] : in[3];
    }
  }

  void FlipWinding(const Shape& shape, bool in_place, Placement& p) {
    const size_t count = size_t{3} * shape.triangle_count;
    if (!in_place) {
      p.first_index = Extend(g_.indices, count);
      std::copy_n(g_.indices.begin() + shape.first_index, count,
                  g_.indices.begin() + p.first_index);
    }
    for (size_t i = 0; i < count; i += 3) {
      std::swap(g_.indices[p.first_index + i + 1], g_.indices[p.first_index + i + 2]);
    }
  }

  void PlaceInstanced(const MeshInstance& instance) {
    const Matrix& m = instance.object_to_world;
    const Mesh& mesh = g_.meshes[instance.mesh];
    plan_.instanced.push_back({instance.mesh, static_cast<int32_t>(g_.placements.size())});
    const std::array<double, 9> normal = NormalMatrix(m);
    double largest =
        0;  // scaled, so that tiny and huge instances keep their normals in float range
    for (const double value : normal) largest = std::max(largest, std::abs(value));
    for (int32_t s = 0; s < mesh.shape_count; ++s) {
      const Shape& shape = g_.shapes[mesh.first_shape + s];
      Placement p = MakePlacement(shape, instance.object);
      p.flags |=
          stages::kPlacementInstanced | (Determinant(m) < 0 ? stages::kPlacementMirrored : 0);
      for (int i = 0; i < 12; ++i) p.object_to_world[i] = static_cast<float>(m[i]);
      for (int i = 0; i < 9; ++i) p.normal_to_world[i] = static_cast<float>(normal[i] / largest);
      plan_.instanced_triangles += shape.triangle_count;
      g_.placements.push_back(p);
    }
  }

  stages::GeometryTables& g_;
  const std::string& where_;
  std::vector<uint32_t> uses_;  // instances per mesh
  std::unordered_map<int32_t, int> vertex_users_, tangent_users_,
      index_users_;  // shapes per offset
  PlacementPlan plan_;
};

}  // namespace

PlacementPlan PlaceInstances(SceneTables& scene, const std::string& where) {
  return Placer(scene, where).Run();
}

}  // namespace carpool::render
