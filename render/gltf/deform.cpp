// Morph targets, then skinning, in the order the specification applies them.
#include "render/gltf/deform.h"

#include <algorithm>

#include "render/gltf/accessors.h"

namespace carpool::render::gltf {
namespace {

/// A vertex attribute of the vertices in use, which must have as many elements as the positions.
std::vector<float> ReadVertices(const Document& document, const Primitive& primitive, int accessor,
                                int components, uint64_t vertex_count, const std::string& pointer) {
  const AccessorLayout layout = ReadLayout(document, accessor);
  if (layout.count != vertex_count || layout.components != components) {
    document.Fail(pointer, "does not match the primitive's POSITION; export the file again");
  }
  return ReadFloats(document, layout, primitive.elements);
}

struct MorphStream {
  const char* name;
  std::vector<float>* values;
  int stride;      // of the stream
  int components;  // of the delta: a tangent's w does not morph
};

void ApplyMorph(const Document& document, const Json& json, const std::vector<double>& weights,
                uint64_t vertex_count, Primitive& primitive) {
  const Json& targets = json["targets"];
  const MorphStream streams[] = {{"POSITION", &primitive.positions, 3, 3},
                                 {"NORMAL", &primitive.normals, 3, 3},
                                 {"TANGENT", &primitive.tangents, 4, 3}};
  for (size_t t = 0; t < std::min(targets.size(), weights.size()); ++t) {
    if (weights[t] == 0) continue;
    for (const MorphStream& stream : streams) {
      const auto found = targets[t].find(stream.name);
      if (found == targets[t].end() || stream.values->empty()) continue;
      const std::string pointer = primitive.pointer + Pointer("targets", t, stream.name);
      const std::vector<float> deltas = ReadVertices(document, primitive, found->get<int>(),
                                                     stream.components, vertex_count, pointer);
      for (size_t v = 0; v < primitive.vertex_count(); ++v) {
        for (int c = 0; c < stream.components; ++c) {
          float& value = (*stream.values)[v * stream.stride + c];
          value = static_cast<float>(value + weights[t] * deltas[v * stream.components + c]);
        }
      }
    }
  }
}

/// The blended joint matrix of each vertex; weights are made to sum to 1.
std::vector<Affine> BlendJoints(const Document& document, const Json& json,
                                std::span<const Affine> joints, uint64_t vertex_count,
                                const Primitive& primitive) {
  std::vector<Affine> blends(primitive.vertex_count(), Affine{});
  std::vector<double> sums(primitive.vertex_count(), 0.0);
  const Json& attributes = json["attributes"];
  for (int set = 0;; ++set) {
    const std::string joints_name = "JOINTS_" + std::to_string(set),
                      weights_name = "WEIGHTS_" + std::to_string(set);
    const auto joint_accessor = attributes.find(joints_name),
               weight_accessor = attributes.find(weights_name);
    if (joint_accessor == attributes.end() || weight_accessor == attributes.end()) break;
    const std::string pointer = primitive.pointer + "/attributes/" + joints_name;
    const std::vector<float> numbers =
        ReadVertices(document, primitive, joint_accessor->get<int>(), 4, vertex_count, pointer);
    const std::vector<float> weights =
        ReadVertices(document, primitive, weight_accessor->get<int>(), 4, vertex_count,
                     primitive.pointer + "/attributes/" + weights_name);
    for (size_t i = 0; i < numbers.size(); ++i) {
      if (!(weights[i] > 0) || !std::isfinite(weights[i])) continue;
      if (!(numbers[i] >= 0 && numbers[i] < static_cast<float>(joints.size()))) {
        document.Fail(pointer, "vertex " + std::to_string(primitive.elements[i / 4]) +
                                   " refers to a joint that the skin lacks; export the file again");
      }
      const Affine& joint = joints[static_cast<size_t>(numbers[i])];
      for (size_t k = 0; k < joint.size(); ++k) blends[i / 4][k] += weights[i] * joint[k];
      sums[i / 4] += weights[i];
    }
  }
  for (size_t v = 0; v < blends.size(); ++v) {
    if (sums[v] == 0)
      blends[v] = joints.front();  // a vertex that nothing moves stays with the first joint
    for (double& value : blends[v]) value = sums[v] == 0 ? value : value / sums[v];
  }
  return blends;
}

void ApplySkin(const Document& document, const Json& json, std::span<const Affine> joints,
               uint64_t vertex_count, Primitive& primitive) {
  const std::vector<Affine> blends = BlendJoints(document, json, joints, vertex_count, primitive);
  for (size_t v = 0; v < blends.size(); ++v) {
    const Affine& blend = blends[v];
    Primitive::Put(primitive.positions, 3, v, TransformPoint(blend, primitive.Position(v)));
    if (!primitive.normals.empty()) {
      const Vec3 normal = TransformNormal(blend, primitive.Normal(v));
      Primitive::Put(primitive.normals, 3, v, NormalizeOr(normal, {0, 0, 0}));
    }
    if (!primitive.tangents.empty()) {
      const Vec3 tangent = TransformVector(blend, Primitive::At(primitive.tangents, 4, v));
      Primitive::Put(primitive.tangents, 4, v, NormalizeOr(tangent, {0, 0, 0}));
      if (Determinant(blend) < 0) primitive.tangents[v * 4 + 3] *= -1;
    }
  }
}

}  // namespace

void ApplyDeform(const Document& document, int mesh, int primitive_index, const Deform& deform,
                 Primitive& primitive) {
  if (deform.empty()) return;
  const Json& json = document.Items("meshes")[mesh]["primitives"][primitive_index];
  const int position_accessor = json["attributes"]["POSITION"];
  const uint64_t vertex_count = ReadLayout(document, position_accessor).count;
  if (!deform.weights.empty() && json.contains("targets")) {
    ApplyMorph(document, json, deform.weights, vertex_count, primitive);
  }
  if (!deform.joints.empty()) ApplySkin(document, json, deform.joints, vertex_count, primitive);
  CheckPositions(document, primitive, position_accessor);
}

}  // namespace carpool::render::gltf
