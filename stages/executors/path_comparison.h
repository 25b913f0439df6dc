// Paths in float against the same paths in double: how far they drift apart, and where they part.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "stages/executors/follow_path.h"

namespace carpool::stages {

/// What two paths may decide differently. From there on they are different paths and are compared
/// no more.
enum class Parting : uint8_t { none, hit, layer, lobe, light, shadow, end };
constexpr size_t kPartings = 7;
std::string_view Name(Parting parting);

/// One moment of a path: what it decided, and what it carries.
struct PathMoment {
  PathStep step;
  int32_t placement, lobe, light;
  uint32_t primitive, flags;
  bool shadow;  // a shadow ray is wanted; once it was traced: some of it got through
  double radiance[3], throughput[3];
  double distance;  // along the ray, to what it hit
};

/// The moments of one path, as FollowPath's observer.
class PathRecorder {
 public:
  explicit PathRecorder(PathProbe& probe) : probe_(probe) {}

  template <class Path>
  void operator()(PathStep step, const Path& path) {
    PathMoment m = {};
    m.step = step;
    m.placement = static_cast<int32_t>(path.placement);
    m.primitive = static_cast<uint32_t>(path.primitive);
    m.flags = static_cast<uint32_t>(path.flags);
    m.distance = static_cast<double>(path.distance);
    m.lobe = probe_.lobe;
    m.light = probe_.light;
    for (int i = 0; i < 3; ++i) {
      m.radiance[i] = static_cast<double>(path.radiance[i]);
      m.throughput[i] = static_cast<double>(path.throughput[i]);
    }
    m.shadow = step == PathStep::shaded     ? path.shadow_distance > 0
               : step == PathStep::shadowed ? Brighter(m)
                                            : false;
    moments_.push_back(m);
    probe_ = {};
  }
  void Clear() {
    moments_.clear();
    probe_ = {};
  }
  const std::vector<PathMoment>& moments() const { return moments_; }

 private:
  /// Than the moment before.
  bool Brighter(const PathMoment& m) const;

  PathProbe& probe_;
  std::vector<PathMoment> moments_;
};

/// A path that drifted far: at its vertex `vertex`, the brightest channel of what it had gathered
/// or of what it carried on was off by `deviation`, relative to itself.
struct WorstPath {
  uint32_t pixel, sample;
  double deviation;
  uint32_t vertex;
  bool gathered;             // radiance; else throughput
  double single, reference;  // the channel's value
  Parting parting;           // how the comparison ended
};

/// A path that parted from its self in double, and what each of the two had before it then.
struct PartedPath {
  struct Hit {
    int32_t placement;
    uint32_t primitive;
    double distance;
  };
  uint32_t pixel = ~0u, sample = ~0u;
  uint32_t vertex = 0;
  Hit single = {}, reference = {};
};

/// All paths that were compared.
struct PathComparison {
  static constexpr size_t kWorst = 10;
  uint64_t paths = 0;
  std::array<uint64_t, kPartings> parted = {};  // by Parting; `none`: together to their end
  /// For each Parting, the path with the least (sample, pixel), whatever the order they came in.
  std::array<PartedPath, kPartings> first = {};
  double sum = 0, reference_sum = 0;  // green of all samples, in float and in double
  double squares = 0;                 // of the deviations of radiance of paths that stayed together
  std::vector<WorstPath> worst;       // at most kWorst, the worst first

  void Add(uint32_t pixel, uint32_t sample, const std::vector<PathMoment>& single,
           const std::vector<PathMoment>& reference);
  PathComparison& operator+=(const PathComparison& other);
};

}  // namespace carpool::stages
