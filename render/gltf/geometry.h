// Meshes of the file become shapes in the shared vertex streams, each stored once.
#pragma once

#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "render/gltf/deform.h"
#include "render/gltf/document.h"
#include "render/gltf/materials.h"

namespace carpool::render::gltf {

/// Properties and assumptions: a mesh is read when a node first asks for it; the same mesh with the
/// same deformation is one entry, and primitives over the same accessors share their streams,
/// whatever their material's factors are. Stops with InputError at the options' geometry limit.
class GeometryBuilder {
 public:
  GeometryBuilder(Document& document, MaterialTable& materials,
                  const std::vector<stages::TextureSlot>& slots)
      : document_(document), materials_(materials), slots_(slots) {}

  /// AddMesh() is the index in `tables.meshes` of a mesh as `deform` bends it, or kNone where it
  /// has no triangles. `skin` (or kNone) stands for `deform.joints` when meshes are compared.
  int AddMesh(int mesh, int skin, const Deform& deform);

  void AddInstance(const stages::MeshInstance& instance);
  uint64_t TriangleCount(int table_mesh) const;

  stages::GeometryTables tables;

 private:
  using MeshKey = std::tuple<int, int, std::vector<double>>;

  stages::Shape BuildShape(int mesh, int primitive, int material, const Deform& deform,
                           bool& drawn);
  stages::Shape StoreShape(const Primitive& primitive);
  int StoreFloats(const std::vector<float>& values);
  void AddTangents(Primitive& primitive, int material);
  std::vector<int> StreamKey(const Json& primitive, int material) const;
  void Charge(uint64_t bytes);

  Document& document_;
  MaterialTable& materials_;
  const std::vector<stages::TextureSlot>& slots_;
  std::map<MeshKey, int> mesh_of_;
  std::map<std::vector<int>, stages::Shape> shape_of_;
  uint64_t bytes_ = 0;
};

}  // namespace carpool::render::gltf
