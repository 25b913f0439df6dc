// Decoding of a primitive: topology to a triangle list, then the attributes of the vertices in use.
#include "render/gltf/primitive.h"

#include <algorithm>
#include <cmath>

#include "render/gltf/accessors.h"

namespace carpool::render::gltf {
namespace {

constexpr int kTriangles = 4, kStrip = 5, kFan = 6;

/// Triangle `k` of a drawing mode as positions in the vertex order, wound as the specification
/// says.
std::array<uint64_t, 3> TriangleCorners(int mode, uint64_t k) {
  if (mode == kStrip) return {k, k + 1 + k % 2, k + 2 - k % 2};
  if (mode == kFan) return {k + 1, k + 2, 0};
  return {3 * k, 3 * k + 1, 3 * k + 2};
}

/// The triangle list of a primitive over accessor elements, checked against the vertex count.
std::vector<uint32_t> ReadTopology(Document& document, const Json& json, uint64_t vertex_count,
                                   const std::string& pointer) {
  const int mode = Get(json, "mode", kTriangles);
  const bool indexed = json.contains("indices");
  std::vector<uint32_t> order;
  if (indexed) order = ReadIndices(document, json["indices"]);
  for (size_t i = 0; i < order.size(); ++i) {
    if (order[i] >= vertex_count) {
      document.Fail(Pointer("accessors", json["indices"].get<int>()),
                    "index " + std::to_string(i) + " is " + std::to_string(order[i]) +
                        ", but the primitive has " + std::to_string(vertex_count) +
                        " vertices; export the file again");
    }
  }
  const uint64_t length = indexed ? order.size() : vertex_count;
  if (mode == kTriangles && length % 3 != 0) {
    document.Warn("incomplete triangle", pointer,
                  "the last triangle is incomplete and is left out");
  }
  const uint64_t triangles = TriangleCount(mode, length);
  std::vector<uint32_t> list;
  list.reserve(triangles * 3);
  for (uint64_t k = 0; k < triangles; ++k) {
    for (uint64_t corner : TriangleCorners(mode, k)) {
      list.push_back(indexed ? order[corner] : static_cast<uint32_t>(corner));
    }
  }
  return list;
}

/// Fills `elements` with the vertices that `indices` use, ascending, and renumbers `indices`. Costs
/// time in proportion to the indices, or to the vertices where most are used.
void KeepUsedVertices(uint64_t vertex_count, Primitive& primitive) {
  std::vector<uint32_t>& elements = primitive.elements;
  if (primitive.indices.size() >= vertex_count / 4) {
    std::vector<bool> used(vertex_count);
    for (uint32_t index : primitive.indices) used[index] = true;
    for (uint64_t i = 0; i < vertex_count; ++i) {
      if (used[i]) elements.push_back(static_cast<uint32_t>(i));
    }
  } else {
    elements = primitive.indices;
    std::sort(elements.begin(), elements.end());
    elements.erase(std::unique(elements.begin(), elements.end()), elements.end());
  }
  if (elements.size() == vertex_count) return;
  for (uint32_t& index : primitive.indices) {
    index = static_cast<uint32_t>(std::lower_bound(elements.begin(), elements.end(), index) -
                                  elements.begin());
  }
}

/// An attribute of the vertices in use, with `components` floats each; empty where the primitive
/// lacks it.
std::vector<float> ReadAttribute(const Document& document, const Json& json,
                                 const std::string& name, uint64_t vertex_count,
                                 const Primitive& primitive, int components) {
  const Json& attributes = json["attributes"];
  const auto found = attributes.find(name);
  if (found == attributes.end()) return {};
  const AccessorLayout layout = ReadLayout(document, found->get<int>());
  const std::string pointer = primitive.pointer + "/attributes/" + name;
  if (layout.count != vertex_count) {
    document.Fail(pointer, "has " + std::to_string(layout.count) + " elements but POSITION has " +
                               std::to_string(vertex_count) + "; export the file again");
  }
  if (layout.components != components) {
    document.Fail(pointer, "must have " + std::to_string(components) +
                               " components per vertex; export the file again");
  }
  return ReadFloats(document, layout, primitive.elements);
}

/// Replaces values that are not finite by 0; one warning for all.
void MendValues(Document& document, std::vector<float>& values, const std::string& pointer) {
  for (float& value : values) {
    if (std::isfinite(value)) continue;
    value = 0;
    document.Warn("not finite", pointer, "holds values that are not finite; 0 is used instead");
  }
}

void ReadUvs(Document& document, const Json& json, uint64_t vertex_count,
             const MaterialNeeds& needs, Primitive& primitive) {
  const size_t sets = needs.uv_sets.size(), vertices = primitive.vertex_count();
  primitive.uv_sets = static_cast<int>(sets);
  primitive.uvs.assign(vertices * sets * 2, 0.0f);
  for (size_t set = 0; set < sets; ++set) {
    const std::string name = "TEXCOORD_" + std::to_string(needs.uv_sets[set]);
    std::vector<float> uvs = ReadAttribute(document, json, name, vertex_count, primitive, 2);
    if (uvs.empty()) {
      document.Warn("missing " + name, primitive.pointer,
                    "the material uses " + name + ", which the primitive lacks; (0, 0) is used");
      continue;
    }
    MendValues(document, uvs, primitive.pointer + "/attributes/" + name);
    for (size_t v = 0; v < vertices; ++v) {
      std::copy_n(&uvs[v * 2], 2, &primitive.uvs[(v * sets + set) * 2]);
    }
  }
}

/// COLOR_0 as RGBA in [0, 1], to which the specification says it is clamped.
void ReadColors(Document& document, const Json& json, uint64_t vertex_count, Primitive& primitive) {
  const auto found = json["attributes"].find("COLOR_0");
  if (found == json["attributes"].end()) return;
  const int components = ReadLayout(document, found->get<int>()).components == 3 ? 3 : 4;
  std::vector<float> colors =
      ReadAttribute(document, json, "COLOR_0", vertex_count, primitive, components);
  MendValues(document, colors, primitive.pointer + "/attributes/COLOR_0");
  primitive.colors.assign(primitive.vertex_count() * 4, 1.0f);
  for (size_t v = 0; v < primitive.vertex_count(); ++v) {
    for (int c = 0; c < components; ++c) {
      primitive.colors[v * 4 + c] = std::clamp(colors[v * components + c], 0.0f, 1.0f);
    }
  }
}

}  // namespace

uint64_t TriangleCount(int mode, uint64_t vertices) {
  if (mode == kTriangles) return vertices / 3;
  return (mode == kStrip || mode == kFan) && vertices >= 3 ? vertices - 2 : 0;
}

uint64_t PrimitiveTriangles(const Document& document, const Json& primitive) {
  const Json& accessors = document.Items("accessors");
  const Json& attributes = primitive["attributes"];
  const auto positions = attributes.find("POSITION");
  if (positions == attributes.end()) return 0;
  const int counted = Get(primitive, "indices", positions->get<int>());
  return TriangleCount(Get(primitive, "mode", kTriangles),
                       accessors[counted]["count"].get<uint64_t>());
}

void CheckPositions(const Document& document, const Primitive& primitive, int accessor) {
  for (size_t i = 0; i < primitive.positions.size(); ++i) {
    if (std::isfinite(primitive.positions[i])) continue;
    document.Fail(Pointer("accessors", accessor), "the position of vertex " +
                                                      std::to_string(primitive.elements[i / 3]) +
                                                      " is not finite; repair the mesh");
  }
}

std::optional<Primitive> DecodePrimitive(Document& document, int mesh, int index,
                                         const MaterialNeeds& needs) {
  const Json& json = document.Items("meshes")[mesh]["primitives"][index];
  Primitive primitive;
  primitive.pointer = Pointer("meshes", mesh, "primitives", index);
  if (Get(json, "mode", kTriangles) < kTriangles) {
    document.Warn("points and lines", primitive.pointer,
                  "points and lines are not rendered; they are left out");
    return std::nullopt;
  }
  if (!json["attributes"].contains("POSITION")) {
    document.Warn("no POSITION", primitive.pointer, "a primitive without POSITION is left out");
    return std::nullopt;
  }
  const int position_accessor = json["attributes"]["POSITION"];
  const uint64_t vertex_count = ReadLayout(document, position_accessor).count;
  primitive.indices = ReadTopology(document, json, vertex_count, primitive.pointer);
  if (primitive.indices.empty()) {
    document.Warn("no triangle", primitive.pointer,
                  "a primitive without a whole triangle is left out");
    return std::nullopt;
  }
  KeepUsedVertices(vertex_count, primitive);
  primitive.positions = ReadAttribute(document, json, "POSITION", vertex_count, primitive, 3);
  CheckPositions(document, primitive, position_accessor);
  primitive.normals = ReadAttribute(document, json, "NORMAL", vertex_count, primitive, 3);
  // Tangents mean nothing without the normals they go with; the specification ignores them then.
  if (needs.tangents && !primitive.normals.empty()) {
    primitive.tangents = ReadAttribute(document, json, "TANGENT", vertex_count, primitive, 4);
  }
  ReadUvs(document, json, vertex_count, needs, primitive);
  ReadColors(document, json, vertex_count, primitive);
  return primitive;
}

}  // namespace carpool::render::gltf
