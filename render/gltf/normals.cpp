// Normals: unit length for the kernels, defaults for those without direction, flat ones on request.
#include "render/gltf/normals.h"

namespace carpool::render::gltf {
namespace {

constexpr Vec3 kUp = {0, 0, 1};

/// Twice the area times the normal of triangle `k`.
Vec3 AreaNormal(const Primitive& primitive, size_t k) {
  const Vec3 a = primitive.Position(primitive.indices[k * 3]);
  return Cross(Subtract(primitive.Position(primitive.indices[k * 3 + 1]), a),
               Subtract(primitive.Position(primitive.indices[k * 3 + 2]), a));
}

bool HasDirection(const Vec3& v) {
  return NormalizeOr(v, {0, 0, 0}) != Vec3{0, 0, 0};
}

/// Sums of the face normals around each vertex.
std::vector<Vec3> SumFaceNormals(const Primitive& primitive) {
  std::vector<Vec3> sums(primitive.vertex_count(), Vec3{0, 0, 0});
  for (size_t k = 0; k < primitive.indices.size() / 3; ++k) {
    const Vec3 normal = AreaNormal(primitive, k);
    for (size_t c = 0; c < 3; ++c) {
      Vec3& sum = sums[primitive.indices[k * 3 + c]];
      sum = Add(sum, normal);
    }
  }
  return sums;
}

void MendTangents(Primitive& primitive) {
  for (size_t v = 0; v < primitive.tangents.size() / 4; ++v) {
    const Vec3 normal = primitive.Normal(v);
    const Vec3 given = Primitive::At(primitive.tangents, 4, v);
    const Vec3 unit = NormalizeOr(given, {0, 0, 0});
    const Vec3 flat = Subtract(unit, Scale(normal, Dot(normal, unit)));
    // Within 1e-4 of the normal, what is left of the direction is rounding.
    const bool usable = Dot(flat, flat) > 1e-8;
    Primitive::Put(primitive.tangents, 4, v,
                   usable ? NormalizeOr(flat, {1, 0, 0}) : AnyPerpendicular(normal));
    float& w = primitive.tangents[v * 4 + 3];
    w = w < 0 ? -1.0f : 1.0f;
  }
}

std::vector<float> Expand(const std::vector<float>& stream, const std::vector<uint32_t>& indices,
                          size_t stride) {
  std::vector<float> out;
  if (stream.empty()) return out;
  out.reserve(indices.size() * stride);
  for (size_t index : indices) {
    out.insert(out.end(), stream.begin() + index * stride, stream.begin() + (index + 1) * stride);
  }
  return out;
}

}  // namespace

Vec3 FaceNormal(const Primitive& primitive, size_t k) {
  return NormalizeOr(AreaNormal(primitive, k), kUp);
}

void MendNormals(Document& document, Primitive& primitive) {
  std::vector<Vec3> sums;  // made when the first vertex asks
  for (size_t v = 0; v < primitive.normals.size() / 3; ++v) {
    const Vec3 given = primitive.Normal(v);
    if (!HasDirection(given) && sums.empty()) {
      document.Warn("zero normals", primitive.pointer,
                    "has normals without direction; those of the faces are used");
      sums = SumFaceNormals(primitive);
    }
    const Vec3 normal = HasDirection(given) ? NormalizeOr(given, kUp) : NormalizeOr(sums[v], kUp);
    Primitive::Put(primitive.normals, 3, v, normal);
  }
  MendTangents(primitive);
}

void SplitIntoFlatTriangles(Primitive& primitive) {
  const std::vector<uint32_t> indices = primitive.indices;
  std::vector<float> normals;
  normals.reserve(indices.size() * 3);
  for (size_t corner = 0; corner < indices.size(); ++corner) {
    for (double value : FaceNormal(primitive, corner / 3))
      normals.push_back(static_cast<float>(value));
  }
  primitive.positions = Expand(primitive.positions, indices, 3);
  primitive.colors = Expand(primitive.colors, indices, 4);
  primitive.uvs = Expand(primitive.uvs, indices, primitive.uv_sets * 2);
  primitive.normals = std::move(normals);
  std::vector<uint32_t> elements(indices.size());
  for (size_t i = 0; i < indices.size(); ++i) {
    elements[i] = primitive.elements[indices[i]];
    primitive.indices[i] = static_cast<uint32_t>(i);
  }
  primitive.elements = std::move(elements);
}

}  // namespace carpool::render::gltf
