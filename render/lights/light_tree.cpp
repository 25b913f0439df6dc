// Builds light records, the light tree and the probabilities of the kinds of light.
#include "render/lights/light_tree.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "render/base/error.h"
#include "render/lights/environment.h"
#include "render/lights/light_cluster.h"
#include "render/lights/split.h"

namespace carpool::render {
namespace {

using stages::Light;
using stages::LightNode;
using stages::LightType;

constexpr double kPi = std::numbers::pi;
constexpr size_t kParallelAbove = 4096;                // lights of a subtree that is worth a task
constexpr size_t kMostLights = (size_t{1} << 26) - 1;  // a kernel's 32-bit index counts their words
constexpr int kDeep = 32;  // past this depth halves are equal: depth stays below 32 + log2(n)

Point3 Wide(const float p[3]) {
  return {p[0], p[1], p[2]};
}
Point3 Minus(const Point3& a, const Point3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Point3 Cross(const Point3& a, const Point3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double Length(const Point3& a) {
  return std::hypot(a[0], a[1], a[2]);
}
double Luminance(const float c[3]) {
  return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
}

/// The direction in unit length, or -Z where it has none.
Point3 UnitOr(const Point3& a) {
  const double length = Length(a);
  if (!(length > 0) || !std::isfinite(length)) return {0, 0, -1};
  return {a[0] / length, a[1] / length, a[2] / length};
}

/// A one-light cluster; its power is 0 where the light emits nothing that could be found.
LightCluster ClusterOf(const TriangleEmission& t, bool mirrored, int32_t light) {
  const Point3 p[3] = {Wide(t.p0), Wide(t.p1), Wide(t.p2)};
  LightCluster c;
  c.light = light;
  const Point3 normal = Cross(Minus(p[1], p[0]), Minus(p[2], p[0]));
  const double power = Length(normal) / 2 * t.radiance_luminance;
  if (!(power > 0) || !std::isfinite(power)) return c;
  c.power = power;
  c.axis = UnitOr(normal);
  if (mirrored) c.axis = {-c.axis[0], -c.axis[1], -c.axis[2]};
  c.theta_e = kPi / 2;
  c.two_sided = t.two_sided;
  for (int i = 0; i < 3; ++i) {
    c.lo[i] = std::min({p[0][i], p[1][i], p[2][i]});
    c.hi[i] = std::max({p[0][i], p[1][i], p[2][i]});
  }
  const Point3 center = Center(c);
  for (const Point3& v : p) c.radius = std::max(c.radius, Length(Minus(v, center)));
  return c;
}

LightCluster ClusterOf(const PunctualInput& p, int32_t light) {
  LightCluster c;
  c.light = light;
  const double power = Luminance(p.intensity);
  if (!(power > 0) || !std::isfinite(power)) return c;
  c.power = power;
  c.lo = c.hi = Wide(p.position);
  c.theta_o = kPi;
  c.theta_e = kPi / 2;
  if (p.type == LightType::spot) {
    c.axis = UnitOr(Wide(p.direction));
    c.theta_o = std::clamp<double>(p.inner_cone, 0, kPi);
    // A millidegree of slack: the kernel's cone is made of rounded cosines.
    c.theta_e = std::max<double>(p.outer_cone - p.inner_cone, 0) + 2e-5;
  }
  return c;
}

Light RecordOf(const TriangleEmission& t, bool mirrored) {
  Light light;
  light.type = t.two_sided ? LightType::two_sided_triangle
               : mirrored  ? LightType::mirrored_triangle
                           : LightType::triangle;
  light.placement = t.placement;
  light.primitive = t.primitive;
  stages::TriangleFields fields;
  std::copy_n(t.p0, 3, fields.p0);
  std::copy_n(t.p1, 3, fields.p1);
  std::copy_n(t.p2, 3, fields.p2);
  fields.red = t.varies ? -1 : t.radiance[0];
  fields.green = t.radiance[1];
  fields.blue = t.radiance[2];
  light.triangle = fields;
  return light;
}

Light RecordOf(const PunctualInput& p) {
  Light light;
  light.type = p.type;
  stages::PunctualFields& fields = light.punctual;
  fields.range = p.range;
  const Point3 direction = UnitOr(Wide(p.direction));
  for (int i = 0; i < 3; ++i) {
    fields.position[i] = p.position[i];
    fields.direction[i] = static_cast<float>(direction[i]);
    fields.intensity[i] = p.intensity[i];
  }
  fields.cos_inner = static_cast<float>(std::cos(double{p.inner_cone}));
  fields.cos_outer = static_cast<float>(std::cos(double{p.outer_cone}));
  return light;
}

/// Records and clusters of all triangles, and where each placement's lights begin.
void AddTriangles(stages::SceneTables& scene, std::span<const TriangleEmission> triangles,
                  std::vector<LightCluster>& clusters) {
  int32_t placement = stages::kNone, next = 0;
  for (size_t i = 0; i < triangles.size(); ++i) {
    const TriangleEmission& t = triangles[i];
    const bool first = t.placement != placement;
    if (t.primitive != (first ? 0 : next) || t.placement < 0 ||
        static_cast<size_t>(t.placement) >= scene.geometry.placements.size()) {
      throw std::invalid_argument(
          "emissive triangles must come placement by placement, all of each");
    }
    stages::Placement& place = scene.geometry.placements[t.placement];
    const int32_t light = static_cast<int32_t>(scene.lights.lights.size());
    if (first) place.first_light = light;
    placement = t.placement;
    next = t.primitive + 1;

    const bool mirrored = (place.flags & stages::kPlacementMirrored) != 0;
    scene.lights.lights.push_back(RecordOf(t, mirrored));
    const LightCluster cluster = ClusterOf(t, mirrored, light);
    if (cluster.power > 0) clusters.push_back(cluster);
  }
}

/// Records of all punctual lights; returns the illuminance of those infinitely far away.
double AddPunctual(stages::LightTables& tables, std::span<const PunctualInput> punctual,
                   std::vector<LightCluster>& clusters) {
  double illuminance = 0;
  for (const PunctualInput& p : punctual) {
    const int32_t light = static_cast<int32_t>(tables.lights.size());
    tables.lights.push_back(RecordOf(p));
    const LightCluster cluster = ClusterOf(p, light);
    if (!(cluster.power > 0)) continue;
    if (p.type == LightType::directional) {
      tables.infinite_lights.push_back(light);
      illuminance += cluster.power;
    } else {
      clusters.push_back(cluster);
    }
  }
  return illuminance;
}

int16_t ToFixed(double multiple) {
  return static_cast<int16_t>(std::clamp(multiple, -32767.0, 32767.0));
}
/// The upper half of the value's bits; `carry` is added to the lower half before: 0xffff rounds
/// away from zero, 0x7fff to the nearest.
uint16_t UpperHalf(double value, uint32_t carry) {
  return static_cast<uint16_t>((std::bit_cast<uint32_t>(static_cast<float>(value)) + carry) >> 16);
}

class TreeBuilder {
 public:
  explicit TreeBuilder(stages::LightTables& tables) : tables_(tables) {}

  /// A tree of n leaves has n - 1 pairs of siblings, beside the root and its unused neighbour.
  LightCluster Build(std::span<LightCluster> lights) {
    double power = 0;
    for (const LightCluster& light : lights) power += light.power;
    for (LightCluster& light : lights) light.power /= power;
    tables_.nodes.resize(2 * lights.size());
    tables_.parents.resize(lights.size());
    LightCluster root = BuildNode(lights, 0, stages::kNone, 2, 0);
    root.power = power;
    return root;
  }

 private:
  /// Builds the subtree over `lights` at `node`; its pairs of children start at node `pairs`.
  LightCluster BuildNode(std::span<LightCluster> lights, int32_t node, int32_t parent,
                         int32_t pairs, int depth) {
    if (lights.size() == 1) {
      tables_.lights[lights[0].light].leaf = node;
      Write(node, parent, lights[0], ~lights[0].light);
      return lights[0];
    }
    const size_t left = SplitLights(lights, depth > kDeep);
    // Pairs: this node's children, then the left subtree's left - 1, then the right subtree's.
    const int32_t left_pairs = pairs + 2, right_pairs = pairs + 2 * static_cast<int32_t>(left);
    LightCluster a, b;
    const auto build_left = [&] {
      a = BuildNode(lights.first(left), pairs, node, left_pairs, depth + 1);
    };
    const auto build_right = [&] {
      b = BuildNode(lights.subspan(left), pairs + 1, node, right_pairs, depth + 1);
    };
    if (lights.size() > kParallelAbove) {
      tbb::parallel_invoke(build_left, build_right);
    } else {
      build_left();
      build_right();
    }
    const LightCluster both = Union(a, b);
    Write(node, parent, both, pairs);
    return both;
  }

  void Write(int32_t node, int32_t parent, const LightCluster& c, int32_t child_or_light) {
    LightNode& n = tables_.nodes[node];
    const Point3 center = Center(c);
    double largest = 0;
    for (int i = 0; i < 3; ++i) {
      n.center[i] = static_cast<float>(center[i]);
      n.axis[i] = ToFixed(std::round(c.axis[i] * stages::kFixedOne));
      largest = std::max(largest, std::abs(center[i]));
    }
    // Outward, past the rounding of the centre and of the radius itself.
    n.radius = UpperHalf(c.radius > 0 ? c.radius * (1 + 1e-6) + largest * 2e-7 : 0, 0xffff);
    n.signed_power = UpperHalf(c.two_sided ? -c.power : c.power, 0x7fff);
    n.cos_theta_o = ToFixed(std::floor(std::cos(c.theta_o) * stages::kFixedOne));
    n.sin_theta_o = ToFixed(std::ceil(std::sin(c.theta_o) * stages::kFixedOne));
    n.cos_theta_e = ToFixed(std::floor(std::cos(std::min(c.theta_e, kPi)) * stages::kFixedOne));
    n.child_or_light = child_or_light;
    if (node % 2 == 0) tables_.parents[static_cast<size_t>(node) / 2] = parent;
  }

  stages::LightTables& tables_;
};

/// Irradiance at the camera, which is the origin, of a cluster shining its best.
double IrradianceAtOrigin(const LightCluster& c) {
  const double distance = std::max({Length(Center(c)), c.radius, 1e-6});
  return c.power / (distance * distance);
}

/// The rule that the header states.
void ChooseProbabilities(stages::LightTables& tables, double tree, double infinite,
                         double environment) {
  const double estimates[3] = {tree, infinite, environment};
  double sum = 0;
  int kinds = 0;
  for (const double e : estimates) {
    sum += e;
    kinds += e > 0;
  }
  const auto share = [&](double e) {
    return e > 0 ? 0.5 / kinds + 0.5 * (std::isfinite(sum) ? e / sum : 1.0 / kinds) : 0.0;
  };
  tables.tree_probability = static_cast<float>(share(tree));
  tables.environment_probability = static_cast<float>(share(environment));
  tables.infinite_probability =
      tables.infinite_lights.empty()
          ? 0
          : static_cast<float>(share(infinite) /
                               static_cast<double>(tables.infinite_lights.size()));
}

}  // namespace

void BuildLightTree(stages::SceneTables& scene, std::span<const TriangleEmission> triangles,
                    std::span<const PunctualInput> punctual) {
  if (triangles.size() + punctual.size() > kMostLights) {
    throw InputError("the scene",
                     "has more than 67,108,863 lights and emissive triangles; "
                     "make fewer materials emissive");
  }
  stages::LightTables& tables = scene.lights;
  tables.lights.clear();
  tables.nodes.clear();
  tables.parents.clear();
  tables.infinite_lights.clear();
  tables.lights.reserve(triangles.size() + punctual.size());
  std::vector<LightCluster> clusters;
  clusters.reserve(triangles.size() + punctual.size());
  AddTriangles(scene, triangles, clusters);
  const double infinite = AddPunctual(tables, punctual, clusters);

  double tree = 0;
  if (!clusters.empty()) {
    const double estimate = IrradianceAtOrigin(TreeBuilder(tables).Build(clusters));
    tree = std::max(estimate, 1e-300);  // present, however faint
  }
  ChooseProbabilities(tables, tree, infinite, kPi * MeanLuminance(tables.environment));
}

}  // namespace carpool::render
