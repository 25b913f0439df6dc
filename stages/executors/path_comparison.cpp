// Walks two records of one path side by side.
#include "stages/executors/path_comparison.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace carpool::stages {
namespace {

uint32_t LayersOf(const PathMoment& m) {
  return m.flags & kPathLayerMask;
}

/// The first thing on which two moments disagree.
Parting PartingOf(const PathMoment& a, const PathMoment& b) {
  if (a.placement != b.placement || (a.placement >= 0 && a.primitive != b.primitive))
    return Parting::hit;
  if (LayersOf(a) != LayersOf(b)) return Parting::layer;
  if (a.lobe != b.lobe) return Parting::lobe;
  if (a.light != b.light) return Parting::light;
  if (a.step != b.step || a.shadow != b.shadow) return Parting::shadow;
  return a.flags != b.flags ? Parting::end : Parting::none;
}

/// Where `vertex` is off the most, in the channels of one triple.
void Drift(const double (&single)[3], const double (&reference)[3], bool gathered,
           const PathMoment& at, WorstPath& worst) {
  const double scale =
      std::max({std::abs(reference[0]), std::abs(reference[1]), std::abs(reference[2]), 1e-30});
  for (int i = 0; i < 3; ++i) {
    const double deviation = std::abs(single[i] - reference[i]) / scale;
    if (deviation <= worst.deviation) continue;
    worst.deviation = deviation;
    worst.vertex = at.flags & kPathDepthMask;
    worst.gathered = gathered;
    worst.single = single[i];
    worst.reference = reference[i];
  }
}

bool WorseThan(const WorstPath& a, const WorstPath& b) {
  return std::tie(b.deviation, a.sample, a.pixel) < std::tie(a.deviation, b.sample, b.pixel);
}

void Keep(std::vector<WorstPath>& worst, const WorstPath& path) {
  const auto place = std::lower_bound(worst.begin(), worst.end(), path, WorseThan);
  if (static_cast<size_t>(place - worst.begin()) >= PathComparison::kWorst) return;
  worst.insert(place, path);
  if (worst.size() > PathComparison::kWorst) worst.pop_back();
}

/// The number of the vertex that a moment is about; the camera's is 0.
uint32_t VertexOf(const PathMoment& m) {
  return (m.flags & kPathDepthMask) + (m.step == PathStep::traced ? 1 : 0);
}

PartedPath::Hit HitOf(const PathMoment& m) {
  return {m.placement, m.primitive, m.distance};
}

void KeepFirst(PartedPath& first, const PartedPath& path) {
  if (std::tie(path.sample, path.pixel) < std::tie(first.sample, first.pixel)) first = path;
}

}  // namespace

std::string_view Name(Parting parting) {
  constexpr std::array<std::string_view, kPartings> kNames = {"none",  "hit",    "layer", "lobe",
                                                              "light", "shadow", "end"};
  return kNames[static_cast<size_t>(parting)];
}

bool PathRecorder::Brighter(const PathMoment& m) const {
  const PathMoment& before = moments_.back();
  for (int i = 0; i < 3; ++i) {
    if (m.radiance[i] > before.radiance[i]) return true;
  }
  return false;
}

void PathComparison::Add(uint32_t pixel, uint32_t sample, const std::vector<PathMoment>& single,
                         const std::vector<PathMoment>& reference) {
  ++paths;
  sum += single.back().radiance[1];
  reference_sum += reference.back().radiance[1];
  WorstPath path = {pixel, sample, 0, 0, false, 0, 0, Parting::none};
  const size_t common = std::min(single.size(), reference.size());
  for (size_t i = 0; i < common && path.parting == Parting::none; ++i) {
    path.parting = PartingOf(single[i], reference[i]);
    if (path.parting != Parting::none) {
      KeepFirst(first[static_cast<size_t>(path.parting)],
                {pixel, sample, VertexOf(reference[i]), HitOf(single[i]), HitOf(reference[i])});
      break;
    }
    Drift(single[i].radiance, reference[i].radiance, true, reference[i], path);
    Drift(single[i].throughput, reference[i].throughput, false, reference[i], path);
  }
  if (path.parting == Parting::none && single.size() != reference.size())
    path.parting = Parting::end;
  ++parted[static_cast<size_t>(path.parting)];
  if (path.parting == Parting::none) {
    WorstPath end = path;
    end.deviation = 0;
    Drift(single.back().radiance, reference.back().radiance, true, reference.back(), end);
    squares += end.deviation * end.deviation;
  }
  Keep(worst, path);
}

PathComparison& PathComparison::operator+=(const PathComparison& other) {
  paths += other.paths;
  for (size_t i = 0; i < kPartings; ++i) {
    parted[i] += other.parted[i];
    KeepFirst(first[i], other.first[i]);
  }
  sum += other.sum;
  reference_sum += other.reference_sum;
  squares += other.squares;
  for (const WorstPath& path : other.worst) Keep(worst, path);
  return *this;
}

}  // namespace carpool::stages
