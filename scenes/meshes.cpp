// Triangle meshes in code.
#include "scenes/meshes.h"

#include <cmath>
#include <utility>

namespace carpool::scenes {

void TriangleMesh::AddQuad(const Point& a, const Point& b, const Point& c, const Point& d) {
  const auto first = static_cast<uint32_t>(positions.size());
  positions.insert(positions.end(), {a, b, c, d});
  for (uint32_t corner : {0u, 1u, 2u, 0u, 2u, 3u}) indices.push_back(first + corner);
}

TriangleMesh MakeBox(const Point& low, const Point& high) {
  const auto corner = [&](int i) {
    return Point{(i & 1 ? high : low)[0], (i & 2 ? high : low)[1], (i & 4 ? high : low)[2]};
  };
  TriangleMesh box;
  static constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                       {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& face : kFaces) {
    box.AddQuad(corner(face[0]), corner(face[1]), corner(face[2]), corner(face[3]));
  }
  return box;
}

TriangleMesh MakeBall(int slices, int stacks) {
  constexpr double kPi = 3.14159265358979323846;
  TriangleMesh ball;
  for (int stack = 0; stack <= stacks; ++stack) {
    const double theta = kPi * stack / stacks;
    for (int slice = 0; slice <= slices; ++slice) {
      const double phi = 2 * kPi * (slice % slices) / slices;
      const double ring = stack == 0 || stack == stacks ? 0 : std::sin(theta);
      ball.positions.push_back({static_cast<float>(ring * std::sin(phi)),
                                static_cast<float>(std::cos(theta)),
                                static_cast<float>(ring * std::cos(phi))});
      ball.uvs.push_back({static_cast<float>(slice) / slices, static_cast<float>(stack) / stacks});
    }
  }
  ball.normals = ball.positions;
  const auto at = [&](int stack, int slice) {
    return static_cast<uint32_t>(stack * (slices + 1) + slice);
  };
  for (int stack = 0; stack < stacks; ++stack) {
    for (int slice = 0; slice < slices; ++slice) {
      const uint32_t a = at(stack, slice), b = at(stack + 1, slice), c = at(stack + 1, slice + 1),
                     d = at(stack, slice + 1);
      if (stack > 0) ball.indices.insert(ball.indices.end(), {a, b, d});
      if (stack + 1 < stacks) ball.indices.insert(ball.indices.end(), {b, c, d});
    }
  }
  return ball;
}

TriangleMesh Reversed(TriangleMesh mesh) {
  for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3)
    std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
  for (Point& normal : mesh.normals) normal = {-normal[0], -normal[1], -normal[2]};
  return mesh;
}

}  // namespace carpool::scenes
