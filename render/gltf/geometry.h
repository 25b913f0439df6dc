// Meshes of the file become shapes in the shared vertex streams, each stored once.
#pragma once

#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "render/gltf/deform.h"
#include "render/gltf/document.h"
#include "render/gltf/materials.h"
#include "render/gltf/primitive.h"

namespace carpool::render::gltf {

/// Properties and assumptions: a mesh is read when a node first asks for it; the same mesh with the
/// same deformation is one entry, and primitives over the same accessors share their streams,
/// whatever their material's factors are. Stops with InputError at the options' geometry limit.
class GeometryBuilder {
 public:
  GeometryBuilder(Document& document, MaterialTable& materials,
                  const std::vector<stages::TextureSlot>& slots)
      : document_(document), materials_(materials), slots_(slots) {}

  /// AddMesh() is the index of a mesh as `deform` bends it in the tables that Finish() gives, or
  /// kNone where it has no triangles. `skin` (or kNone) stands for `deform.joints` when meshes are
  /// compared.
  int AddMesh(int mesh, int skin, const Deform& deform);

  void AddInstance(const stages::MeshInstance& instance);

  /// Finish() hands over all that was added; the builder is of no use after it.
  stages::GeometryTables Finish();

 private:
  using MeshKey = std::tuple<int, int, std::vector<double>>;

  /// A shape whose streams are still to be stored: tangents of many are made in parallel.
  struct Waiting {
    int32_t shape;
    Primitive primitive;
  };

  bool AddShape(int mesh, int primitive, const Deform& deform);
  void StoreWaiting();
  void StoreStreams(const Primitive& primitive, stages::Shape& shape);
  int StoreFloats(const std::vector<float>& values);
  void AddTangents(Primitive& primitive, int material) const;
  std::vector<int> StreamKey(const Json& primitive, int material) const;
  void Charge(uint64_t bytes);

  Document& document_;
  MaterialTable& materials_;
  const std::vector<stages::TextureSlot>& slots_;
  std::map<MeshKey, int> mesh_of_;
  stages::GeometryTables tables_;
  std::map<std::vector<int>, int32_t> shape_of_;  // the first shape with these streams
  // Shapes, each with the one whose streams it shows.
  std::vector<std::pair<int32_t, int32_t>> copies_;
  std::vector<Waiting> waiting_;
  uint64_t waiting_numbers_ = 0;  // floats and indices of those
  uint64_t bytes_ = 0;
};

}  // namespace carpool::render::gltf
