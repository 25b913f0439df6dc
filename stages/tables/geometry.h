// Triangle geometry as the kernels read it: shared vertex streams and one record per placed shape.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "stages/tables/huge_pages.h"

namespace carpool::stages {

constexpr int32_t kNone = -1;  // an absent stream, texture, light or material

/// A *shape* is the triangles of one glTF primitive. Its streams live in `GeometryTables`; offsets
/// count elements of the stream (floats, or indices), so that a lane gathers with one 32-bit index.
struct Shape {
  int32_t first_index = 0;  // into `indices`; triangle k uses [first_index + 3k, +3)
  int32_t triangle_count = 0;
  int32_t vertex_count = 0;
  int32_t positions = 0;     // into `floats`: 3 per vertex
  int32_t normals = kNone;   // 3 per vertex, unit length; kNone: flat
  int32_t tangents = kNone;  // 4 per vertex, w = +-1 handedness; kNone: no normal map needs them
  int32_t uvs = kNone;  // `uv_sets` pairs per vertex, interleaved: ((vertex * uv_sets) + set) * 2
  int32_t uv_sets = 0;
  int32_t colors = kNone;  // 4 per vertex, linear RGBA
  int32_t material = 0;
};

/// A shape where the scene puts it; 32 words, gathered by field. Flat placements have their
/// vertices baked in world space and an identity transform.
struct alignas(128) Placement {
  int32_t first_index = 0;
  int32_t positions = 0;
  int32_t normals = kNone;
  int32_t tangents = kNone;
  int32_t uvs = kNone;
  int32_t uv_sets = 0;
  int32_t colors = kNone;
  int32_t material = 0;
  int32_t flags = 0;   // PlacementFlags
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

struct GeometryTables {
  UnsetHugeVector<float> floats;      // all vertex streams, at most 2^31 - 1 elements
  UnsetHugeVector<uint32_t> indices;  // vertex numbers within the shape, at most 2^31 - 1 elements
  std::vector<Shape> shapes;
  std::vector<Mesh> meshes;
  std::vector<MeshInstance> instances;
  std::vector<Placement> placements;  // made by the BVH build from the above
};

}  // namespace carpool::stages
