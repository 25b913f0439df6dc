// Shares, means and the list of the worst paths.
#include "render/session/comparison.h"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace carpool::render {
namespace {

using stages::Parting;
using stages::PathComparison;
using stages::WorstPath;

std::string Format(const char* format, auto... values) {
  char line[256];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

uint64_t Together(const PathComparison& c) {
  return c.parted[static_cast<size_t>(Parting::none)];
}

double RootMeanSquare(const PathComparison& c) {
  return Together(c) > 0 ? std::sqrt(c.squares / static_cast<double>(Together(c))) : 0;
}

double MeanDifference(const PathComparison& c) {
  return c.reference_sum > 0 ? c.sum / c.reference_sum - 1 : 0;
}

/// "hit 12, lobe 1": why paths parted.
std::string Causes(const PathComparison& c) {
  std::string text;
  for (size_t i = 1; i < stages::kPartings; ++i) {
    if (c.parted[i] == 0) continue;
    text += (text.empty() ? "" : ", ") + std::string(Name(static_cast<Parting>(i))) + " " +
            std::to_string(c.parted[i]);
  }
  return text.empty() ? "none" : text;
}

uint32_t Column(const RenderSummary& s, uint32_t pixel) {
  return pixel % static_cast<uint32_t>(s.width);
}
uint32_t Row(const RenderSummary& s, uint32_t pixel) {
  return pixel / static_cast<uint32_t>(s.width);
}

std::string HitText(const stages::PartedPath::Hit& hit) {
  if (hit.placement < 0) return "nothing";
  return Format("triangle %u of mesh %d at %.9g", hit.primitive, hit.placement, hit.distance);
}

/// The first path that parted for each cause.
std::string FirstParted(const RenderSummary& s) {
  std::string text;
  for (size_t i = 1; i < stages::kPartings; ++i) {
    const stages::PartedPath& first = s.comparison.first[i];
    if (s.comparison.parted[i] == 0 || first.pixel == ~0u) continue;
    text += Format("    the first parted by %s: pixel %u,%u sample %u at vertex %u, which is ",
                   std::string(Name(static_cast<Parting>(i))).c_str(), Column(s, first.pixel),
                   Row(s, first.pixel), first.sample, first.vertex) +
            HitText(first.single);
    if (i == static_cast<size_t>(Parting::hit)) text += " instead of " + HitText(first.reference);
    text += "\n";
  }
  return text;
}

}  // namespace

std::string ComparisonText(const RenderSummary& s) {
  const PathComparison& c = s.comparison;
  std::string text = Format("  float against double: %llu paths, parted by rounding: ",
                            static_cast<unsigned long long>(c.paths)) +
                     Causes(c) + "\n" +
                     Format(
                         "  the others' samples: root mean square %.2g off; all samples' mean: "
                         "%.2g off; the worst paths until they part:\n",
                         RootMeanSquare(c), MeanDifference(c));
  for (const WorstPath& w : c.worst) {
    text += Format("    pixel %u,%u sample %u: %.2g off at vertex %u, %s %.9g instead of %.9g\n",
                   Column(s, w.pixel), Row(s, w.pixel), w.sample, w.deviation, w.vertex,
                   w.gathered ? "radiance" : "throughput", w.single, w.reference);
  }
  return text + FirstParted(s);
}

nlohmann::ordered_json ComparisonJson(const RenderSummary& s) {
  const PathComparison& c = s.comparison;
  nlohmann::ordered_json json = {{"paths", c.paths}, {"together", Together(c)}};
  for (size_t i = 1; i < stages::kPartings; ++i)
    json["parted"][std::string(Name(static_cast<Parting>(i)))] = c.parted[i];
  json["root_mean_square"] = RootMeanSquare(c);
  json["mean"] = MeanDifference(c);
  json["worst"] = nlohmann::ordered_json::array();
  for (const WorstPath& w : c.worst) {
    json["worst"].push_back({{"pixel", {Column(s, w.pixel), Row(s, w.pixel)}},
                             {"sample", w.sample},
                             {"deviation", w.deviation},
                             {"vertex", w.vertex},
                             {"quantity", w.gathered ? "radiance" : "throughput"},
                             {"float", w.single},
                             {"double", w.reference},
                             {"parting", Name(w.parting)}});
  }
  return json;
}

}  // namespace carpool::render
