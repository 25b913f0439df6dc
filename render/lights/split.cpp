// The bucketed surface area orientation heuristic (Conty Estevez & Kulla 2018, section 4.4).
#include "render/lights/split.h"

#include <algorithm>
#include <array>
#include <limits>

namespace carpool::render {
namespace {

constexpr int kBuckets = 12;

/// The box of the lights' centres.
struct Extent {
  Point3 lo, hi;
  double Length(int axis) const { return hi[axis] - lo[axis]; }
  double Longest() const { return std::max({Length(0), Length(1), Length(2)}); }
};

Extent CentersOf(std::span<const LightCluster> lights) {
  Extent e = {Center(lights[0]), Center(lights[0])};
  for (const LightCluster& light : lights) {
    const Point3 c = Center(light);
    for (int i = 0; i < 3; ++i) {
      e.lo[i] = std::min(e.lo[i], c[i]);
      e.hi[i] = std::max(e.hi[i], c[i]);
    }
  }
  return e;
}

int BucketOf(const LightCluster& light, const Extent& e, int axis) {
  const double at = (Center(light)[axis] - e.lo[axis]) / e.Length(axis);
  return std::clamp(static_cast<int>(at * kBuckets), 0, kBuckets - 1);
}

struct Split {
  int axis = -1;   // -1: none found
  int bucket = 0;  // the last one of the left side
  double cost = std::numeric_limits<double>::infinity();
};

void TryAxis(std::span<const LightCluster> lights, const Extent& e, int axis, Split& best) {
  std::array<LightCluster, kBuckets> buckets;
  for (const LightCluster& light : lights) {
    LightCluster& bucket = buckets[BucketOf(light, e, axis)];
    bucket = Union(bucket, light);
  }
  std::array<double, kBuckets> right_cost{};
  LightCluster right;
  for (int i = kBuckets - 1; i > 0; --i) {
    right = Union(right, buckets[i]);
    right_cost[i - 1] = Cost(right);
  }
  // Favours dividing the long axis, so that clusters do not become slabs.
  const double regularise = e.Longest() / e.Length(axis);
  LightCluster left;
  for (int i = 0; i + 1 < kBuckets; ++i) {
    left = Union(left, buckets[i]);
    const double cost = regularise * (Cost(left) + right_cost[i]);
    if (cost < best.cost) best = {axis, i, cost};
  }
}

/// Half of the lights to each side of the longest axis.
size_t SplitInHalves(std::span<LightCluster> lights, const Extent& e) {
  int axis = 0;
  for (int i = 1; i < 3; ++i) axis = e.Length(i) > e.Length(axis) ? i : axis;
  const size_t half = lights.size() / 2;
  std::nth_element(lights.begin(), lights.begin() + half, lights.end(),
                   [axis](const LightCluster& a, const LightCluster& b) {
                     const double x = Center(a)[axis], y = Center(b)[axis];
                     return x != y ? x < y : a.light < b.light;
                   });
  return half;
}

}  // namespace

size_t SplitLights(std::span<LightCluster> lights, bool deep) {
  if (lights.size() == 2) return 1;
  const Extent e = CentersOf(lights);
  Split best;
  for (int axis = 0; axis < 3 && !deep; ++axis) {
    if (e.Length(axis) > 0) TryAxis(lights, e, axis, best);
  }
  if (best.axis >= 0) {
    const auto middle = std::partition(lights.begin(), lights.end(), [&](const LightCluster& l) {
      return BucketOf(l, e, best.axis) <= best.bucket;
    });
    const size_t left = static_cast<size_t>(middle - lights.begin());
    if (left > 0 && left < lights.size()) return left;
  }
  return SplitInHalves(lights, e);
}

}  // namespace carpool::render
