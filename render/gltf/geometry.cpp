// Shapes and meshes: decode, deform, mend, add tangents, store; each distinct primitive once.
#include "render/gltf/geometry.h"

#include <limits>

#include "render/gltf/normals.h"
#include "render/gltf/primitive.h"
#include "render/gltf/tangents.h"

namespace carpool::render::gltf {

using stages::kNone;

int GeometryBuilder::AddMesh(int mesh, int skin, const Deform& deform) {
  const auto [found, is_new] = mesh_of_.try_emplace({mesh, skin, deform.weights}, kNone);
  if (!is_new) return found->second;
  const Json& primitives = document_.Items("meshes")[mesh]["primitives"];
  stages::Mesh entry{static_cast<int32_t>(tables.shapes.size()), 0};
  for (size_t p = 0; p < primitives.size(); ++p) {
    const bool has_material = primitives[p].contains("material");
    const int material =
        has_material ? primitives[p]["material"].get<int>() : materials_.DefaultMaterial();
    bool drawn = true;
    const stages::Shape shape = BuildShape(mesh, static_cast<int>(p), material, deform, drawn);
    if (!drawn) continue;
    Charge(sizeof shape);
    tables.shapes.push_back(shape);
    ++entry.shape_count;
  }
  if (entry.shape_count == 0) return kNone;
  tables.meshes.push_back(entry);
  return found->second = static_cast<int>(tables.meshes.size()) - 1;
}

void GeometryBuilder::AddInstance(const stages::MeshInstance& instance) {
  Charge(sizeof instance);
  tables.instances.push_back(instance);
}

uint64_t GeometryBuilder::TriangleCount(int table_mesh) const {
  const stages::Mesh& mesh = tables.meshes[table_mesh];
  uint64_t count = 0;
  for (int s = 0; s < mesh.shape_count; ++s)
    count += tables.shapes[mesh.first_shape + s].triangle_count;
  return count;
}

stages::Shape GeometryBuilder::BuildShape(int mesh, int index, int material, const Deform& deform,
                                          bool& drawn) {
  const Json& json = document_.Items("meshes")[mesh]["primitives"][index];
  const std::vector<int> key = StreamKey(json, material);
  if (const auto found = shape_of_.find(key); deform.empty() && found != shape_of_.end()) {
    stages::Shape shape = found->second;
    shape.material = material;
    return shape;
  }
  std::optional<Primitive> primitive =
      DecodePrimitive(document_, mesh, index, materials_.needs[material]);
  drawn = primitive.has_value();
  if (!drawn) return {};
  ApplyDeform(document_, mesh, index, deform, *primitive);
  MendNormals(document_, *primitive);
  AddTangents(*primitive, material);
  stages::Shape shape = StoreShape(*primitive);
  shape.material = material;
  if (deform.empty()) shape_of_.emplace(key, shape);
  return shape;
}

void GeometryBuilder::AddTangents(Primitive& primitive, int material) {
  if (!materials_.needs[material].tangents || !primitive.tangents.empty()) return;
  // Tangents follow normals. A flat mesh has one normal per triangle, so its vertices part; the
  // stream of normals is dropped again, because the kernels make flat normals themselves.
  const bool flat = primitive.normals.empty();
  if (flat) SplitIntoFlatTriangles(primitive);
  const int slot = materials_.materials[material].slots[static_cast<int>(stages::Slot::normal)];
  GenerateTangents(primitive, slots_[slot].uv_set, slots_[slot].transform);
  if (flat) primitive.normals.clear();
}

stages::Shape GeometryBuilder::StoreShape(const Primitive& primitive) {
  constexpr size_t kMost = std::numeric_limits<int32_t>::max();
  const size_t floats = primitive.positions.size() + primitive.normals.size() +
                        primitive.tangents.size() + primitive.uvs.size() + primitive.colors.size();
  if (tables.floats.size() + floats > kMost ||
      tables.indices.size() + primitive.indices.size() > kMost) {
    document_.Fail(primitive.pointer,
                   "the scene has more vertices than 32-bit offsets can number; "
                   "instance its meshes or split it");
  }
  Charge((floats + primitive.indices.size()) * 4);
  stages::Shape shape;
  shape.first_index = static_cast<int32_t>(tables.indices.size());
  shape.triangle_count = static_cast<int32_t>(primitive.indices.size() / 3);
  shape.vertex_count = static_cast<int32_t>(primitive.vertex_count());
  shape.positions = StoreFloats(primitive.positions);
  shape.normals = StoreFloats(primitive.normals);
  shape.tangents = StoreFloats(primitive.tangents);
  shape.uvs = StoreFloats(primitive.uvs);
  shape.uv_sets = shape.uvs == kNone ? 0 : primitive.uv_sets;
  shape.colors = StoreFloats(primitive.colors);
  tables.indices.insert(tables.indices.end(), primitive.indices.begin(), primitive.indices.end());
  return shape;
}

int GeometryBuilder::StoreFloats(const std::vector<float>& values) {
  if (values.empty()) return kNone;
  const int offset = static_cast<int>(tables.floats.size());
  tables.floats.insert(tables.floats.end(), values.begin(), values.end());
  return offset;
}

/// Everything that the streams of a primitive depend on.
std::vector<int> GeometryBuilder::StreamKey(const Json& primitive, int material) const {
  const MaterialNeeds& needs = materials_.needs[material];
  const Json& attributes = primitive["attributes"];
  std::vector<int> key = {Get(primitive, "mode", 4), Get(primitive, "indices", kNone)};
  for (const char* name : {"POSITION", "NORMAL", "COLOR_0"})
    key.push_back(Get(attributes, name, kNone));
  for (int set : needs.uv_sets)
    key.push_back(Get(attributes, ("TEXCOORD_" + std::to_string(set)).c_str(), kNone));
  if (needs.tangents) {
    const int slot = materials_.materials[material].slots[static_cast<int>(stages::Slot::normal)];
    key.push_back(Get(attributes, "TANGENT", kNone));
    key.push_back(slot);  // its UV set and transform decide generated tangents
  }
  return key;
}

void GeometryBuilder::Charge(uint64_t bytes) {
  bytes_ += bytes;
  if (bytes_ > document_.options.max_geometry_bytes) {
    throw InputError(document_.name,
                     "the scene's geometry needs more than the limit of " +
                         std::to_string(document_.options.max_geometry_bytes >> 20) +
                         " MiB; instance its meshes or split it");
  }
}

}  // namespace carpool::render::gltf
