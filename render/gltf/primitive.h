// One primitive of a mesh, decoded to a triangle list and plain float streams.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "render/gltf/affine.h"
#include "render/gltf/document.h"
#include "render/gltf/materials.h"

namespace carpool::render::gltf {

/// Streams that are empty are absent. Only vertices that a triangle uses are here: primitives of
/// one mesh often share large accessors of which each uses a part.
struct Primitive {
  std::string pointer;             // "/meshes/1/primitives/0"
  std::vector<uint32_t> elements;  // accessor element of each vertex, ascending
  std::vector<uint32_t> indices;   // triangle list over the vertices
  std::vector<float> positions;    // 3 per vertex
  std::vector<float> normals;      // 3
  std::vector<float> tangents;     // 4
  std::vector<float> uvs;          // 2 * uv_sets
  std::vector<float> colors;       // 4
  int uv_sets = 0;

  size_t vertex_count() const { return positions.size() / 3; }
  Vec3 Position(size_t vertex) const { return At(positions, 3, vertex); }
  Vec3 Normal(size_t vertex) const { return At(normals, 3, vertex); }

  /// Three floats of a stream at `vertex`, and the way back.
  static Vec3 At(const std::vector<float>& stream, int stride, size_t vertex) {
    const float* p = &stream[vertex * stride];
    return {p[0], p[1], p[2]};
  }
  static void Put(std::vector<float>& stream, int stride, size_t vertex, const Vec3& value) {
    for (int i = 0; i < 3; ++i) stream[vertex * stride + i] = static_cast<float>(value[i]);
  }
};

/// DecodePrimitive() reads what the material needs of a primitive; nullopt for points and lines,
/// for primitives without positions and for those with no triangle, each with a warning.
std::optional<Primitive> DecodePrimitive(Document& document, int mesh, int primitive,
                                         const MaterialNeeds& needs);

/// CheckPositions() throws InputError that names the accessor and vertex of a NaN or infinite
/// position.
void CheckPositions(const Document& document, const Primitive& primitive, int accessor);

/// TriangleCount() is how many triangles `vertices` make in a drawing mode; 0 for points and lines.
uint64_t TriangleCount(int mode, uint64_t vertices);

/// PrimitiveTriangles() counts by the accessors alone, without reading any.
uint64_t PrimitiveTriangles(const Document& document, const Json& primitive);

}  // namespace carpool::render::gltf
