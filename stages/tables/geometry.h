// Triangle geometry as the kernels read it: shared vertex streams and one record per placed shape.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stages/tables/huge_pages.h"

namespace carpool::stages {

constexpr int32_t kNone = -1;  // an absent stream, texture, light or material

/// What most hits read of a vertex, together: half a cache line, where three streams would be three
/// lines.
struct alignas(32) MeshVertex {
  float position[3];
  float normal[3];  // unit length; 0: that of the triangle
  float uv[2];      // the first set
};
static_assert(sizeof(MeshVertex) == 32);

/// A *shape* is the triangles of one glTF primitive. Its vertices, and streams of what few vertices
/// have, live in `GeometryTables`; offsets count elements (vertices, floats or indices), so that a
/// lane gathers with one 32-bit index.
struct Shape {
  int32_t first_index = 0;  // into `indices`; triangle k uses [first_index + 3k, +3)
  int32_t triangle_count = 0;
  int32_t first_vertex = 0;  // into `vertices`
  int32_t vertex_count = 0;
  bool smooth = false;       // vertices have normals
  int32_t uv_sets = 0;       // the first is in the vertices, ...
  int32_t more_uvs = kNone;  // ... others in `floats`: (vertex * (uv_sets - 1) + (set - 1)) * 2
  int32_t tangents =
      kNone;               // into `floats`: 4 per vertex, w = +-1 handedness; kNone: no normal map
  int32_t colors = kNone;  // into `floats`: 4 per vertex, linear RGBA
  int32_t material = 0;
};

/// A shape where the scene puts it; 32 words, gathered by field. Flat placements have their
/// vertices baked in world space and an identity transform.
struct alignas(128) Placement {
  int32_t first_index = 0;
  int32_t first_vertex = 0;
  int32_t flags = 0;  // PlacementFlags
  int32_t material = 0;
  int32_t tangents = kNone;
  int32_t colors = kNone;
  int32_t uv_sets = 0;
  int32_t more_uvs = kNone;
  int32_t object = 0;  // glTF node index + 1, for the object id AOV
  int32_t first_light =
      kNone;  // light of triangle 0; triangle k is first_light + k; kNone: not emissive
  float object_to_world[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  // 3x4, row-major
  float normal_to_world[9] = {1, 0, 0, 0, 1,
                              0, 0, 0, 1};  // 3x3 cofactors x sign of the determinant, row-major
};
static_assert(sizeof(Placement) == 128);

enum PlacementFlags : int32_t {
  kPlacementInstanced = 1,  // vertices are in object space
  kPlacementMirrored = 2,   // determinant < 0: winding and tangent handedness flip (instanced only;
                            // flat placements are baked with the right winding)
  kPlacementSmooth = 4,     // vertices have normals
};

/// Where one node puts one mesh (a range of shapes). `object_to_world` is in double and relative to
/// `SceneTables::origin`.
struct MeshInstance {
  int32_t mesh = 0;
  int32_t object = 0;
  std::array<double, 12> object_to_world = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  // 3x4, row-major
};

/// A glTF mesh: shapes [first_shape, first_shape + shape_count).
struct Mesh {
  int32_t first_shape = 0;
  int32_t shape_count = 0;
};

/// Lanes number the vertices' floats by 31 bits.
constexpr size_t kMostVertices = size_t{1} << 28;

struct GeometryTables {
  UnsetHugeVector<MeshVertex> vertices;  // at most kMostVertices
  UnsetHugeVector<float> floats;         // the other vertex streams, at most 2^31 - 1 elements
  UnsetHugeVector<uint32_t> indices;  // vertex numbers within the shape, at most 2^31 - 1 elements
  std::vector<Shape> shapes;
  std::vector<Mesh> meshes;
  std::vector<MeshInstance> instances;
  std::vector<Placement> placements;  // made by the BVH build from the above
};

}  // namespace carpool::stages
