// Names of the causes, and places as people count them.
#include "render/session/ledger.h"

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace carpool::render {
namespace {

using stages::SampleFault;
using stages::SampleLedger;

struct FaultName {
  SampleFault fault;
  const char *words, *key;
};
constexpr std::array<FaultName, stages::kSampleFaults> kFaults{
    {{SampleFault::not_finite, "not finite", "not_finite"},
     {SampleFault::too_large, "too large for the film", "too_large"},
     {SampleFault::negative, "negative", "negative"},
     {SampleFault::clamped, "clamped", "clamped"}}};

double RemovedShare(const SampleLedger& ledger) {
  return ledger.energy > 0 ? ledger.removed_energy / ledger.energy : 0;
}

/// Column and row of a pixel.
std::array<uint32_t, 2> Place(const RenderSummary& s, uint32_t pixel) {
  const auto width = static_cast<uint32_t>(s.width);
  return {pixel % width, pixel / width};
}

}  // namespace

std::string LedgerText(const RenderSummary& s) {
  std::string text;
  for (const FaultName& name : kFaults) {
    if (name.fault == SampleFault::clamped && s.clamp == 0) continue;
    const SampleLedger::Entry& entry = s.ledger.Of(name.fault);
    text += (text.empty() ? "" : ", ") + std::to_string(entry.count) + " " + name.words;
    if (entry.count == 0) continue;
    const auto [x, y] = Place(s, entry.pixel);
    text += " (first: pixel " + std::to_string(x) + "," + std::to_string(y) + ", sample " +
            std::to_string(entry.sample) + ")";
  }
  if (s.clamp > 0) {
    char share[96];
    std::snprintf(share, sizeof share, "; the clamp at %g removed %.4g %% of the energy", s.clamp,
                  100 * RemovedShare(s.ledger));
    text += share;
  }
  return text;
}

nlohmann::ordered_json LedgerJson(const RenderSummary& s) {
  nlohmann::ordered_json json;
  for (const FaultName& name : kFaults) {
    const SampleLedger::Entry& entry = s.ledger.Of(name.fault);
    json[name.key] = {{"count", entry.count}};
    if (entry.count == 0) continue;
    json[name.key]["first"] = {{"pixel", Place(s, entry.pixel)}, {"sample", entry.sample}};
  }
  json["clamp"] = s.clamp;
  json["energy_removed"] = RemovedShare(s.ledger);
  return json;
}

}  // namespace carpool::render
