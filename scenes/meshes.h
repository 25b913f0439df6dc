// Triangle meshes in code: squares, boxes and balls.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace carpool::scenes {

using Point = std::array<float, 3>;

/// Without normals a mesh is flat; without UVs it takes no texture.
struct TriangleMesh {
  std::vector<Point> positions;
  std::vector<Point> normals;
  std::vector<std::array<float, 2>> uvs;
  std::vector<uint32_t> indices;

  /// AddQuad() adds two triangles that face the side from which a, b, c, d run counter-clockwise.
  void AddQuad(const Point& a, const Point& b, const Point& c, const Point& d);
};

/// A box from `low` to `high` that faces out.
TriangleMesh MakeBox(const Point& low, const Point& high);

/// A ball of radius 1 of 2 * slices * (stacks - 1) triangles, with its positions as normals and
/// UVs.
TriangleMesh MakeBall(int slices, int stacks);

/// The same mesh seen from the other side.
TriangleMesh Reversed(TriangleMesh mesh);

}  // namespace carpool::scenes
