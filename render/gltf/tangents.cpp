// The MikkTSpace rule in four steps: weld corners, link triangles, group them around vertices,
// average.
#include "render/gltf/tangents.h"

#include <algorithm>
#include <cfloat>
#include <cstring>
#include <map>
#include <tuple>
#include <unordered_map>

namespace carpool::render::gltf {
namespace {

constexpr int kNone = -1;

struct CornerKey {
  std::array<float, 8> values;  // position, normal, uv
  bool operator==(const CornerKey&) const = default;
};

struct CornerHash {
  size_t operator()(const CornerKey& key) const {
    uint64_t hash = 0x9E3779B97F4A7C15u;
    for (float value : key.values) {
      uint32_t bits;
      std::memcpy(&bits, &value, sizeof bits);
      hash = (hash ^ bits) * 0xFF51AFD7ED558CCDu;
      hash ^= hash >> 32;
    }
    return hash;
  }
};

struct Triangle {
  Vec3 tangent = {0, 0, 0};  // unit, along growing u
  bool positive = false;     // UV orientation
  bool any_group = true;     // UVs span no area: joins whatever group comes first
  bool degenerate = false;   // positions span no area: takes part in nothing
  std::array<int, 3> neighbor = {kNone, kNone, kNone};  // across edge (corner i, corner i + 1)
  std::array<int, 3> group = {kNone, kNone, kNone};     // per corner
};

struct Group {
  uint32_t vertex = 0;  // welded
  bool positive = false;
  std::vector<int> triangles;
};

bool IsZero(double x) {
  return !(std::fabs(x) > FLT_MIN);
}

class Generator {
 public:
  Generator(const Primitive& primitive, int uv_set, const float transform[6]);

  /// The tangent of each corner: x, y, z, w.
  std::vector<std::array<float, 4>> Run();

 private:
  using Uv = std::array<double, 2>;

  void WeldCorners(int uv_set);
  void MeasureTriangle(int t);
  void LinkTriangles();
  void BuildGroups();
  void GrowGroup(int group, int start);
  std::array<float, 4> EvaluateGroup(const Group& group) const;
  double CornerAngle(int t, int corner, const Vec3& normal) const;

  Vec3 PositionOf(int t, int corner) const {
    return primitive_.Position(primitive_.indices[t * 3 + corner]);
  }
  Vec3 NormalOf(int t, int corner) const {
    return primitive_.Normal(primitive_.indices[t * 3 + corner]);
  }
  int CornerAt(int t, uint32_t vertex) const;

  const Primitive& primitive_;
  std::vector<Uv> uvs_;           // per corner, transformed
  std::vector<uint32_t> welded_;  // per corner
  std::vector<Triangle> triangles_;
  std::vector<Group> groups_;
};

Generator::Generator(const Primitive& primitive, int uv_set, const float transform[6])
    : primitive_(primitive) {
  triangles_.resize(primitive.indices.size() / 3);
  uvs_.reserve(primitive.indices.size());
  for (uint32_t index : primitive.indices) {
    const float* uv = &primitive.uvs[(size_t{index} * primitive.uv_sets + uv_set) * 2];
    const double u = uv[0], v = uv[1];
    uvs_.push_back({transform[0] * u + transform[1] * v + transform[2],
                    transform[3] * u + transform[4] * v + transform[5]});
  }
  WeldCorners(uv_set);
}

void Generator::WeldCorners(int uv_set) {
  std::unordered_map<CornerKey, uint32_t, CornerHash> seen;
  seen.reserve(primitive_.vertex_count());
  std::vector<uint32_t> of_vertex(primitive_.vertex_count());
  for (size_t v = 0; v < of_vertex.size(); ++v) {
    CornerKey key;
    std::copy_n(&primitive_.positions[v * 3], 3, key.values.begin());
    std::copy_n(&primitive_.normals[v * 3], 3, key.values.begin() + 3);
    std::copy_n(&primitive_.uvs[(v * primitive_.uv_sets + uv_set) * 2], 2, key.values.begin() + 6);
    for (float& value : key.values) value += 0.0f;  // -0 equals 0
    of_vertex[v] = seen.try_emplace(key, static_cast<uint32_t>(v)).first->second;
  }
  welded_.reserve(primitive_.indices.size());
  for (uint32_t index : primitive_.indices) welded_.push_back(of_vertex[index]);
}

void Generator::MeasureTriangle(int t) {
  Triangle& triangle = triangles_[t];
  const Vec3 p0 = PositionOf(t, 0), p1 = PositionOf(t, 1), p2 = PositionOf(t, 2);
  triangle.degenerate = p0 == p1 || p1 == p2 || p2 == p0;
  const Vec3 d1 = Subtract(p1, p0), d2 = Subtract(p2, p0);
  const Uv &t0 = uvs_[t * 3], &t1 = uvs_[t * 3 + 1], &t2 = uvs_[t * 3 + 2];
  const double u1 = t1[0] - t0[0], v1 = t1[1] - t0[1], u2 = t2[0] - t0[0], v2 = t2[1] - t0[1];
  const double area = u1 * v2 - v1 * u2;
  triangle.positive = area > 0;
  if (IsZero(area)) return;
  const Vec3 along_u = Subtract(Scale(d1, v2), Scale(d2, v1));
  const Vec3 along_v = Subtract(Scale(d2, u1), Scale(d1, u2));
  triangle.tangent = Scale(NormalizeOr(along_u, {0, 0, 0}), triangle.positive ? 1 : -1);
  const double size_u = std::sqrt(Dot(along_u, along_u)), size_v = std::sqrt(Dot(along_v, along_v));
  triangle.any_group = IsZero(size_u / std::fabs(area)) || IsZero(size_v / std::fabs(area));
}

void Generator::LinkTriangles() {
  struct Edge {
    uint32_t low, high;
    int triangle, side;
    bool forward;  // runs from low to high
  };
  std::vector<Edge> edges;
  for (int t = 0; t < static_cast<int>(triangles_.size()); ++t) {
    if (triangles_[t].degenerate) continue;
    for (int side = 0; side < 3; ++side) {
      const uint32_t a = welded_[t * 3 + side], b = welded_[t * 3 + (side + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), t, side, a < b});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high, a.triangle, a.side) <
           std::tie(b.low, b.high, b.triangle, b.side);
  });
  for (size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    // Of the triangles at one edge, each takes the next free one that runs along it the other way.
    // The two lists of free triangles are consumed in order, so that a fan of thousands stays
    // linear.
    std::vector<const Edge*> waiting[2];
    size_t first[2] = {0, 0};
    for (end = begin; end < edges.size() && edges[end].low == edges[begin].low &&
                      edges[end].high == edges[begin].high;
         ++end) {
      const Edge& edge = edges[end];
      const int other = edge.forward ? 0 : 1;
      if (first[other] == waiting[other].size()) {
        waiting[1 - other].push_back(&edge);
        continue;
      }
      const Edge& partner = *waiting[other][first[other]++];
      triangles_[edge.triangle].neighbor[edge.side] = partner.triangle;
      triangles_[partner.triangle].neighbor[partner.side] = edge.triangle;
    }
  }
}

int Generator::CornerAt(int t, uint32_t vertex) const {
  for (int corner = 0; corner < 3; ++corner) {
    if (welded_[t * 3 + corner] == vertex) return corner;
  }
  return kNone;
}

void Generator::BuildGroups() {
  for (int t = 0; t < static_cast<int>(triangles_.size()); ++t) {
    for (int corner = 0; corner < 3; ++corner) {
      const Triangle& triangle = triangles_[t];
      if (triangle.degenerate || triangle.any_group || triangle.group[corner] != kNone) continue;
      groups_.push_back({welded_[t * 3 + corner], triangle.positive, {}});
      GrowGroup(static_cast<int>(groups_.size()) - 1, t);
    }
  }
}

/// Walks from triangle to triangle around the group's vertex; a list in place of recursion.
void Generator::GrowGroup(int index, int start) {
  Group& group = groups_[index];
  std::vector<int> open = {start};
  while (!open.empty()) {
    const int t = open.back();
    open.pop_back();
    Triangle& triangle = triangles_[t];
    const int corner = CornerAt(t, group.vertex);
    if (corner == kNone || triangle.group[corner] != kNone) continue;
    const bool untouched = triangle.group == std::array<int, 3>{kNone, kNone, kNone};
    if (triangle.any_group && untouched) triangle.positive = group.positive;
    if (triangle.positive != group.positive) continue;
    triangle.group[corner] = index;
    group.triangles.push_back(t);
    for (int side : {(corner + 2) % 3, corner}) {
      if (triangle.neighbor[side] != kNone) open.push_back(triangle.neighbor[side]);
    }
  }
}

double Generator::CornerAngle(int t, int corner, const Vec3& normal) const {
  const Vec3 here = PositionOf(t, corner);
  Vec3 sides[2] = {Subtract(PositionOf(t, (corner + 1) % 3), here),
                   Subtract(PositionOf(t, (corner + 2) % 3), here)};
  for (Vec3& side : sides)
    side = NormalizeOr(Subtract(side, Scale(normal, Dot(normal, side))), {0, 0, 0});
  return std::acos(std::clamp(Dot(sides[0], sides[1]), -1.0, 1.0));
}

std::array<float, 4> Generator::EvaluateGroup(const Group& group) const {
  const int first = group.triangles.front();
  const Vec3 normal = NormalOf(first, CornerAt(first, group.vertex));
  Vec3 sum = {0, 0, 0};
  for (int t : group.triangles) {
    if (triangles_[t].any_group) continue;
    const Vec3& tangent = triangles_[t].tangent;
    const Vec3 flat =
        NormalizeOr(Subtract(tangent, Scale(normal, Dot(normal, tangent))), {0, 0, 0});
    sum = Add(sum, Scale(flat, CornerAngle(t, CornerAt(t, group.vertex), normal)));
  }
  const Vec3 tangent =
      IsZero(Dot(sum, sum)) ? AnyPerpendicular(normal) : NormalizeOr(sum, {1, 0, 0});
  return {static_cast<float>(tangent[0]), static_cast<float>(tangent[1]),
          static_cast<float>(tangent[2]), group.positive ? -1.0f : 1.0f};
}

std::vector<std::array<float, 4>> Generator::Run() {
  for (size_t t = 0; t < triangles_.size(); ++t) MeasureTriangle(static_cast<int>(t));
  LinkTriangles();
  BuildGroups();
  std::vector<std::array<float, 4>> of_group;
  std::unordered_map<uint32_t, std::array<float, 4>>
      of_vertex;  // for corners that belong to no group
  for (const Group& group : groups_) {
    of_group.push_back(EvaluateGroup(group));
    of_vertex.try_emplace(group.vertex, of_group.back());
  }
  std::vector<std::array<float, 4>> out(primitive_.indices.size());
  for (size_t corner = 0; corner < out.size(); ++corner) {
    const int group = triangles_[corner / 3].group[corner % 3];
    const auto found = of_vertex.find(welded_[corner]);
    if (group != kNone) {
      out[corner] = of_group[group];
    } else if (found != of_vertex.end()) {
      out[corner] = found->second;
    } else {
      const Vec3 some = AnyPerpendicular(primitive_.Normal(primitive_.indices[corner]));
      out[corner] = {static_cast<float>(some[0]), static_cast<float>(some[1]),
                     static_cast<float>(some[2]), 1};
    }
  }
  return out;
}

/// Appends a copy of vertex `v` to a stream.
void CopyVertex(std::vector<float>& stream, size_t stride, size_t v) {
  if (stream.empty()) return;
  for (size_t i = 0; i < stride; ++i) {
    const float value = stream[v * stride + i];
    stream.push_back(value);
  }
}

/// Gives each vertex its corners' tangent; further tangents at one vertex get a copy of it.
void AssignTangents(Primitive& primitive, const std::vector<std::array<float, 4>>& corners) {
  const size_t original = primitive.vertex_count();
  std::vector<bool> assigned(original);
  std::map<std::pair<uint32_t, std::array<float, 4>>, uint32_t> copies;
  primitive.tangents.assign(original * 4, 0.0f);
  for (size_t corner = 0; corner < corners.size(); ++corner) {
    uint32_t& index = primitive.indices[corner];
    const std::array<float, 4>& tangent = corners[corner];
    if (!assigned[index]) {
      assigned[index] = true;
      std::copy(tangent.begin(), tangent.end(), &primitive.tangents[size_t{index} * 4]);
    }
    if (std::equal(tangent.begin(), tangent.end(), &primitive.tangents[size_t{index} * 4]))
      continue;
    const auto [found, is_new] =
        copies.try_emplace({index, tangent}, static_cast<uint32_t>(primitive.vertex_count()));
    if (is_new) {
      CopyVertex(primitive.positions, 3, index);
      CopyVertex(primitive.normals, 3, index);
      CopyVertex(primitive.uvs, primitive.uv_sets * 2, index);
      CopyVertex(primitive.colors, 4, index);
      primitive.elements.push_back(primitive.elements[index]);
      primitive.tangents.insert(primitive.tangents.end(), tangent.begin(), tangent.end());
    }
    index = found->second;
  }
}

}  // namespace

void GenerateTangents(Primitive& primitive, int uv_set, const float transform[6]) {
  AssignTangents(primitive, Generator(primitive, uv_set, transform).Run());
}

}  // namespace carpool::render::gltf
