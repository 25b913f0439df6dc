// Shapes and meshes: decode, deform, mend, add tangents, store; each distinct primitive once.
#include "render/gltf/geometry.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "render/gltf/normals.h"
#include "render/gltf/tangents.h"

namespace carpool::render::gltf {

using stages::kNone;

namespace {
/// Numbers that may wait for tangents to be made in parallel; the limit on the scene's geometry
/// does not see them yet.
constexpr uint64_t kNumbersAtOnce = 8 << 20;

/// In all streams of a primitive.
uint64_t FloatsOf(const Primitive& p) {
  return p.positions.size() + p.normals.size() + p.tangents.size() + p.uvs.size() + p.colors.size();
}

stages::MeshVertex VertexOf(const Primitive& p, size_t i) {
  stages::MeshVertex v = {};
  std::copy_n(&p.positions[3 * i], 3, v.position);
  if (!p.normals.empty()) std::copy_n(&p.normals[3 * i], 3, v.normal);
  if (!p.uvs.empty()) std::copy_n(&p.uvs[i * p.uv_sets * 2], 2, v.uv);
  return v;
}

/// All sets but the first.
std::vector<float> FurtherUvs(const Primitive& p) {
  std::vector<float> uvs;
  if (p.uvs.empty() || p.uv_sets < 2) return uvs;
  const size_t width = size_t{2} * p.uv_sets;
  uvs.reserve(p.vertex_count() * (width - 2));
  for (size_t at = 0; at < p.uvs.size(); at += width)
    uvs.insert(uvs.end(), &p.uvs[at + 2], &p.uvs[at] + width);
  return uvs;
}
}  // namespace

int GeometryBuilder::AddMesh(int mesh, int skin, const Deform& deform) {
  const auto [found, is_new] = mesh_of_.try_emplace({mesh, skin, deform.weights}, kNone);
  if (!is_new) return found->second;
  const Json& primitives = document_.Items("meshes")[mesh]["primitives"];
  stages::Mesh entry{static_cast<int32_t>(tables_.shapes.size()), 0};
  for (size_t p = 0; p < primitives.size(); ++p) {
    if (AddShape(mesh, static_cast<int>(p), deform)) ++entry.shape_count;
  }
  if (entry.shape_count == 0) return kNone;
  tables_.meshes.push_back(entry);
  return found->second = static_cast<int>(tables_.meshes.size()) - 1;
}

void GeometryBuilder::AddInstance(const stages::MeshInstance& instance) {
  Charge(sizeof instance);
  tables_.instances.push_back(instance);
}

stages::GeometryTables GeometryBuilder::Finish() {
  StoreWaiting();
  for (const auto& [shape, original] : copies_) {
    const int32_t material = tables_.shapes[shape].material;
    tables_.shapes[shape] = tables_.shapes[original];
    tables_.shapes[shape].material = material;
  }
  return std::move(tables_);
}

/// Appends a shape, whose streams follow when it is stored; false where there is nothing to draw.
bool GeometryBuilder::AddShape(int mesh, int index, const Deform& deform) {
  const Json& json = document_.Items("meshes")[mesh]["primitives"][index];
  const int material =
      json.contains("material") ? json["material"].get<int>() : materials_.DefaultMaterial();
  const auto shape = static_cast<int32_t>(tables_.shapes.size());
  const std::vector<int> key = StreamKey(json, material);
  if (const auto found = shape_of_.find(key); deform.empty() && found != shape_of_.end()) {
    copies_.emplace_back(shape, found->second);
  } else {
    std::optional<Primitive> primitive =
        DecodePrimitive(document_, mesh, index, materials_.needs[material]);
    if (!primitive) return false;
    ApplyDeform(document_, mesh, index, deform, *primitive);
    MendNormals(document_, *primitive);
    if (deform.empty()) shape_of_.emplace(key, shape);
    waiting_numbers_ += FloatsOf(*primitive) + primitive->indices.size();
    waiting_.push_back({shape, std::move(*primitive)});
  }
  Charge(sizeof(stages::Shape));
  tables_.shapes.emplace_back().material = material;
  if (waiting_numbers_ > kNumbersAtOnce) StoreWaiting();
  return true;
}

void GeometryBuilder::StoreWaiting() {
  tbb::parallel_for(size_t{0}, waiting_.size(), [&](size_t i) {
    AddTangents(waiting_[i].primitive, tables_.shapes[waiting_[i].shape].material);
  });
  for (const Waiting& waiting : waiting_)
    StoreStreams(waiting.primitive, tables_.shapes[waiting.shape]);
  waiting_.clear();
  waiting_numbers_ = 0;
}

void GeometryBuilder::AddTangents(Primitive& primitive, int material) const {
  if (!materials_.needs[material].tangents || !primitive.tangents.empty()) return;
  // Tangents follow normals. A flat mesh has one normal per triangle, so its vertices part; the
  // stream of normals is dropped again, because the kernels make flat normals themselves.
  const bool flat = primitive.normals.empty();
  if (flat) SplitIntoFlatTriangles(primitive);
  const int slot = materials_.materials[material].slots[static_cast<int>(stages::Slot::normal)];
  GenerateTangents(primitive, slots_[slot].uv_set, slots_[slot].transform);
  if (flat) primitive.normals.clear();
}

void GeometryBuilder::StoreStreams(const Primitive& primitive, stages::Shape& shape) {
  constexpr size_t kMost = std::numeric_limits<int32_t>::max();
  const size_t vertices = primitive.vertex_count();
  const std::vector<float> uvs = FurtherUvs(primitive);
  const uint64_t floats = primitive.tangents.size() + uvs.size() + primitive.colors.size();
  if (tables_.vertices.size() + vertices > stages::kMostVertices ||
      tables_.floats.size() + floats > kMost ||
      tables_.indices.size() + primitive.indices.size() > kMost) {
    document_.Fail(primitive.pointer,
                   "the scene has more vertices than 32-bit offsets can number; "
                   "instance its meshes or split it");
  }
  Charge(vertices * sizeof(stages::MeshVertex) + (floats + primitive.indices.size()) * 4);
  shape.first_index = static_cast<int32_t>(tables_.indices.size());
  shape.triangle_count = static_cast<int32_t>(primitive.indices.size() / 3);
  shape.first_vertex = static_cast<int32_t>(tables_.vertices.size());
  shape.vertex_count = static_cast<int32_t>(vertices);
  shape.smooth = !primitive.normals.empty();
  tables_.vertices.resize(tables_.vertices.size() + vertices);
  for (size_t i = 0; i < vertices; ++i)
    tables_.vertices[shape.first_vertex + i] = VertexOf(primitive, i);
  shape.uv_sets = primitive.uvs.empty() ? 0 : primitive.uv_sets;
  shape.more_uvs = StoreFloats(uvs);
  shape.tangents = StoreFloats(primitive.tangents);
  shape.colors = StoreFloats(primitive.colors);
  tables_.indices.insert(tables_.indices.end(), primitive.indices.begin(), primitive.indices.end());
}

int GeometryBuilder::StoreFloats(const std::vector<float>& values) {
  if (values.empty()) return kNone;
  const int offset = static_cast<int>(tables_.floats.size());
  tables_.floats.insert(tables_.floats.end(), values.begin(), values.end());
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
