// Nodes: parents before children in one pass, so that neither depth nor cycles can hurt.
#include "render/gltf/nodes.h"

#include <algorithm>
#include <charconv>
#include <map>

#include "render/gltf/accessors.h"
#include "render/gltf/uri.h"

namespace carpool::render::gltf {
namespace {

using stages::kNone;

/// A rotation as a unit quaternion; one without length turns nothing.
std::array<double, 4> Normalized(const std::array<double, 4>& q) {
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(length > 0) || !std::isfinite(length)) return {0, 0, 0, 1};
  return {q[0] / length, q[1] / length, q[2] / length, q[3] / length};
}

Affine LocalMatrix(Document& document, const Json& node, const std::string& pointer) {
  if (!node.contains("matrix")) {
    return FromTrs(Numbers<3>(node, "translation", {0, 0, 0}),
                   Normalized(Numbers<4>(node, "rotation", {0, 0, 0, 1})),
                   Numbers<3>(node, "scale", {1, 1, 1}));
  }
  const auto m = Numbers<16>(node, "matrix", {});
  if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1) {
    document.Warn("matrix not affine", pointer + "/matrix",
                  "the last row is not 0 0 0 1; it is taken to be");
  }
  return {m[0], m[4], m[8], m[12], m[1], m[5], m[9], m[13], m[2], m[6], m[10], m[14]};
}

/// The parent of each node, kNone for roots.
std::vector<int> ReadParents(const Document& document) {
  const Json& nodes = document.Items("nodes");
  std::vector<int> parents(nodes.size(), kNone);
  for (size_t n = 0; n < nodes.size(); ++n) {
    const auto children = nodes[n].find("children");
    if (children == nodes[n].end()) continue;
    for (size_t c = 0; c < children->size(); ++c) {
      const int child = (*children)[c];
      if (parents[child] != kNone) {
        document.Fail(Pointer("nodes", n, "children", c),
                      "node " + std::to_string(child) + " already has a parent (node " +
                          std::to_string(parents[child]) + "); each node may have one");
      }
      parents[child] = static_cast<int>(n);
    }
  }
  return parents;
}

/// All nodes below `roots`, the roots included, parents before children and in file order.
std::vector<int> Walk(const Document& document, const std::vector<int>& roots) {
  const Json& nodes = document.Items("nodes");
  std::vector<bool> seen(nodes.size());
  std::vector<int> order;
  std::vector<int> open(roots.rbegin(), roots.rend());
  while (!open.empty()) {
    const int node = open.back();
    open.pop_back();
    if (seen[node]) continue;  // a root listed twice, or below another root
    seen[node] = true;
    order.push_back(node);
    const auto children = nodes[node].find("children");
    if (children == nodes[node].end()) continue;
    for (auto child = children->rbegin(); child != children->rend(); ++child)
      open.push_back(child->get<int>());
  }
  return order;
}

/// The scene that the options ask for, by name first and then by index.
int ChooseScene(const Document& document) {
  const Json& scenes = document.Items("scenes");
  const std::string& wanted = document.options.scene;
  if (wanted.empty()) return scenes.empty() ? -1 : Get(document.json, "scene", 0);
  std::string known;
  for (size_t i = 0; i < scenes.size(); ++i) {
    const std::string name = Get<std::string>(scenes[i], "name", "");
    if (name == wanted) return static_cast<int>(i);
    known += i ? ", " : "";
    known += std::to_string(i);
    if (!name.empty()) known.append(" ").append(Quoted(name));
  }
  int index = -1;
  const char* end = wanted.data() + wanted.size();
  const auto parsed = std::from_chars(wanted.data(), end, index);
  if (parsed.ec == std::errc() && parsed.ptr == end && index >= 0 &&
      index < static_cast<int>(scenes.size())) {
    return index;
  }
  document.Fail("/scenes", "there is no scene " + Quoted(wanted) + "; choose one of: " +
                               (known.empty() ? "(the file has none)" : known));
}

std::vector<int> SceneRoots(Document& document, int scene, const std::vector<int>& parents) {
  std::vector<int> roots;
  if (scene < 0) {
    for (size_t n = 0; n < parents.size(); ++n) {
      if (parents[n] == kNone) roots.push_back(static_cast<int>(n));
    }
    return roots;
  }
  const Json& list = document.Items("scenes")[scene];
  if (!list.contains("nodes")) return roots;
  for (const Json& node : list["nodes"]) {
    roots.push_back(node.get<int>());
    if (parents[roots.back()] != kNone) {
      document.Warn("root with parent", Pointer("scenes", scene, "nodes"),
                    "node " + std::to_string(roots.back()) +
                        " is a root here but has a parent, "
                        "whose transform it keeps");
    }
  }
  return roots;
}

/// The per-instance transforms of EXT_mesh_gpu_instancing, relative to the node.
std::vector<Affine> ReadGpuInstances(const Document& document, const Json& extension,
                                     const std::string& pointer) {
  const Json& attributes = extension["attributes"];
  std::optional<uint64_t> count;
  const auto read = [&](const char* name, int components) -> std::vector<float> {
    const auto found = attributes.find(name);
    if (found == attributes.end()) return {};
    const AccessorLayout layout = ReadLayout(document, found->get<int>());
    if (layout.components != components || layout.count != count.value_or(layout.count)) {
      document.Fail(pointer + "/attributes/" + name,
                    "has the wrong type, or another count than its fellows; "
                    "export the file again");
    }
    count = layout.count;
    return ReadFloats(document, layout);
  };
  const std::vector<float> t = read("TRANSLATION", 3), r = read("ROTATION", 4),
                           s = read("SCALE", 3);
  std::vector<Affine> instances;
  for (size_t i = 0; i < count.value_or(0); ++i) {
    const Vec3 translation = t.empty() ? Vec3{0, 0, 0} : Primitive::At(t, 3, i);
    const Vec3 scale = s.empty() ? Vec3{1, 1, 1} : Primitive::At(s, 3, i);
    std::array<double, 4> rotation = {0, 0, 0, 1};
    if (!r.empty()) rotation = {r[i * 4], r[i * 4 + 1], r[i * 4 + 2], r[i * 4 + 3]};
    instances.push_back(FromTrs(translation, Normalized(rotation), scale));
  }
  return instances;
}

/// Where the joints of a skin stand: matrices from mesh space to world, less `anchor`, the place of
/// the first joint, so that vertices far from the origin keep their precision in float.
std::vector<Affine> ReadJoints(const Document& document, const NodeTree& tree, int skin,
                               Vec3& anchor) {
  const Json& json = document.Items("skins")[skin];
  const Json& joints = json["joints"];
  if (joints.empty())
    document.Fail(Pointer("skins", skin, "joints"), "is empty; export the file again");
  std::vector<float> inverse_binds;
  if (json.contains("inverseBindMatrices")) {
    const AccessorLayout layout = ReadLayout(document, json["inverseBindMatrices"]);
    if (layout.components != 16 || layout.count < joints.size()) {
      document.Fail(Pointer("skins", skin, "inverseBindMatrices"),
                    "must be one MAT4 per joint; export the file again");
    }
    inverse_binds = ReadFloats(document, layout);
  }
  const Affine& first = tree.worlds[joints[0].get<int>()];
  anchor = {first[3], first[7], first[11]};
  std::vector<Affine> out;
  for (size_t j = 0; j < joints.size(); ++j) {
    Affine world = tree.worlds[joints[j].get<int>()];
    for (int axis = 0; axis < 3; ++axis) world[axis * 4 + 3] -= anchor[axis];
    if (!inverse_binds.empty()) {
      const float* m = &inverse_binds[j * 16];
      world = Multiply(
          world, {m[0], m[4], m[8], m[12], m[1], m[5], m[9], m[13], m[2], m[6], m[10], m[14]});
    }
    if (!IsFinite(world))
      document.Fail(Pointer("skins", skin),
                    "joint " + std::to_string(j) + " is not finite; repair the skin");
    out.push_back(world);
  }
  return out;
}

/// Weights of the morph targets as a node shows a mesh; empty where all are zero.
std::vector<double> MorphWeights(const Json& node, const Json& mesh) {
  const Json& owner = node.contains("weights") ? node : mesh;
  std::vector<double> weights;
  if (owner.contains("weights")) weights = owner["weights"].get<std::vector<double>>();
  const bool any = std::any_of(weights.begin(), weights.end(), [](double w) { return w != 0; });
  return any ? weights : std::vector<double>();
}

class Placer {
 public:
  Placer(Document& document, const NodeTree& tree, GeometryBuilder& geometry)
      : document_(document), tree_(tree), geometry_(geometry) {}

  void PlaceNode(int index) {
    const Json& node = document_.Items("nodes")[index];
    if (!node.contains("mesh")) return;
    const std::string pointer = Pointer("nodes", index);
    const int mesh = node["mesh"];
    Deform deform;
    deform.weights = MorphWeights(node, document_.Items("meshes")[mesh]);
    if (node.contains("skin")) return PlaceSkinned(index, mesh, node["skin"], deform);
    const int entry = geometry_.AddMesh(mesh, kNone, deform);
    if (entry == kNone) return;
    const Json* instancing = Extension(node, "EXT_mesh_gpu_instancing");
    if (!instancing) return Place(index, entry, tree_.worlds[index]);
    const std::string where = pointer + "/extensions/EXT_mesh_gpu_instancing";
    for (const Affine& local : ReadGpuInstances(document_, *instancing, where)) {
      Place(index, entry, Multiply(tree_.worlds[index], local));
    }
  }

 private:
  /// A skinned mesh stands where its joints are; the transform of its own node does not count.
  void PlaceSkinned(int node, int mesh, int skin, Deform& deform) {
    const auto [found, is_new] = poses_.try_emplace(skin);
    Pose& pose = found->second;
    if (is_new) pose.joints = ReadJoints(document_, tree_, skin, pose.anchor);
    deform.joints = pose.joints;
    const int entry = geometry_.AddMesh(mesh, skin, deform);
    if (entry == kNone) return;
    Affine world = kIdentity;
    for (int axis = 0; axis < 3; ++axis) world[axis * 4 + 3] = pose.anchor[axis];
    Place(node, entry, world);
  }

  void Place(int node, int mesh, const Affine& world) {
    if (!IsFinite(world)) {
      document_.Fail(Pointer("nodes", node), "the node's transform is not finite; repair it");
    }
    geometry_.AddInstance({mesh, node + 1, world});
  }

  struct Pose {
    std::vector<Affine> joints;
    Vec3 anchor = {0, 0, 0};
  };

  Document& document_;
  const NodeTree& tree_;
  GeometryBuilder& geometry_;
  std::map<int, Pose> poses_;  // per skin, which many nodes may share
};

}  // namespace

NodeTree ReadNodes(Document& document) {
  const Json& nodes = document.Items("nodes");
  const std::vector<int> parents = ReadParents(document);
  const std::vector<int> order = Walk(document, SceneRoots(document, -1, parents));
  if (order.size() != nodes.size()) {
    // With one parent each, what no root reaches goes round in a circle, or hangs below one.
    std::vector<bool> reached(nodes.size());
    for (int node : order) reached[node] = true;
    const auto missed = std::find(reached.begin(), reached.end(), false) - reached.begin();
    document.Fail(Pointer("nodes", missed),
                  "the node is its own ancestor, or below one that is; break the cycle");
  }
  NodeTree tree;
  tree.worlds.resize(nodes.size(), kIdentity);
  for (int node : order) {
    const Affine local = LocalMatrix(document, nodes[node], Pointer("nodes", node));
    const int parent = parents[node];
    tree.worlds[node] = parent == kNone ? local : Multiply(tree.worlds[parent], local);
  }
  tree.scene = ChooseScene(document);
  tree.drawn = Walk(document, SceneRoots(document, tree.scene, parents));
  return tree;
}

void PlaceMeshes(Document& document, const NodeTree& tree, GeometryBuilder& geometry) {
  Placer placer(document, tree, geometry);
  for (int node : tree.drawn) placer.PlaceNode(node);
}

}  // namespace carpool::render::gltf
