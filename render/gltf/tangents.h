// Tangents by the MikkTSpace rule, for normal maps on meshes that bring none.
#pragma once

#include <array>
#include <vector>

#include "render/gltf/primitive.h"

namespace carpool::render::gltf {

/// GenerateTangents() fills `primitive.tangents` from positions, normals and one UV set, moved by
/// the normal map's texture transform (2x3, as TextureSlot's). Vertices whose corners need
/// different tangents are split. The rule is MikkTSpace's, so that maps baked with it are read back
/// as baked: corners are welded where position, normal and UV are equal; around each welded vertex,
/// triangles that are connected by edges and agree in UV orientation form a group; a group's
/// tangent is the mean of its triangles' tangents in the normal's plane, weighted by the angle at
/// the vertex. glTF's v points down, so w is -1 where UV orientation is positive. A vertex without
/// any usable UV gets some perpendicular of its normal.
void GenerateTangents(Primitive& primitive, int uv_set, const float transform[6]);

}  // namespace carpool::render::gltf
