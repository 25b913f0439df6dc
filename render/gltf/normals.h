// Normals and given tangents made unit length, with a documented default where they have no
// direction.
#pragma once

#include "render/gltf/primitive.h"

namespace carpool::render::gltf {

/// FaceNormal() is the unit normal of triangle `k`, +Z for one without area.
Vec3 FaceNormal(const Primitive& primitive, size_t k);

/// MendNormals() normalises. A zero or non-finite normal becomes the area-weighted mean of the face
/// normals around its vertex, or +Z where those have no direction either. Given tangents are made
/// perpendicular and unit length, with w = +-1; one without direction becomes any perpendicular.
void MendNormals(Document& document, Primitive& primitive);

/// SplitIntoFlatTriangles() gives each corner a vertex of its own and the normal of its face.
void SplitIntoFlatTriangles(Primitive& primitive);

}  // namespace carpool::render::gltf
