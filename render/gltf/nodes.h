// The node hierarchy: world matrices in double, the nodes of a scene, and what they place.
#pragma once

#include <string>
#include <vector>

#include "render/gltf/affine.h"
#include "render/gltf/document.h"
#include "render/gltf/geometry.h"

namespace carpool::render::gltf {

struct NodeTree {
  std::vector<Affine> worlds;  // per node of the file
  std::vector<int> drawn;      // nodes of the chosen scene, parents first
  int scene = -1;              // which scene that is; -1: the file has none, all roots are drawn
};

/// ReadNodes() computes all world matrices and walks the chosen scene. Throws InputError for cycles
/// and for nodes with two parents. Depth is limited by memory only: nothing recurses.
NodeTree ReadNodes(Document& document);

/// PlaceMeshes() adds an instance for each mesh that the drawn nodes show, GPU instances included.
void PlaceMeshes(Document& document, const NodeTree& tree, GeometryBuilder& geometry);

}  // namespace carpool::render::gltf
