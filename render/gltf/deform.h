// Morph targets and skins in the file's rest pose: vertices are moved once, at import.
#pragma once

#include <span>
#include <vector>

#include "render/gltf/primitive.h"

namespace carpool::render::gltf {

/// How one node bends the mesh it shows. Both lists may be empty.
struct Deform {
  std::vector<double> weights;     // one per morph target
  std::span<const Affine> joints;  // mesh space to skinned space, per joint of the skin

  bool empty() const { return weights.empty() && joints.empty(); }
};

/// ApplyDeform() moves a primitive's vertices, normals and tangents. Throws InputError for
/// accessors that do not fit and for positions that leave the range of float.
void ApplyDeform(const Document& document, int mesh, int primitive_index, const Deform& deform,
                 Primitive& primitive);

}  // namespace carpool::render::gltf
