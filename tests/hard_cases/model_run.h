// Counts samples that are not as they should be, over every scene of some folders.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "stages/film/accumulator.h"
#include "tools/bench/rows.h"

namespace carpool::test {

/// What to render: every scene in its own light (or a neutral sky, if it has none) and under each
/// of some skies, in turn, with a fresh seed each time, until that many camera paths are done.
struct ModelRun {
  std::vector<std::string> folders;  // searched for .gltf and .glb, with all below them
  std::vector<std::string> skies;    // lat-long .exr or .hdr
  double paths = 1e9;
  uint32_t seed = 0;
};

/// What all their ledgers of samples say.
struct ModelTally {
  uint64_t scenes = 0, refused = 0, renders = 0;
  double paths = 0, seconds = 0;
  std::array<uint64_t, stages::kSampleFaults> faults = {};
};

/// Says on standard error how far it is, and on standard output how to replay each path that comes
/// first in a ledger. Ends early when interrupted.
ModelTally CountSamples(const ModelRun& run);

/// A sample that was not finite, too large, negative or clamped is a fault.
std::vector<tools::Row> RowsOf(const ModelTally& tally);

}  // namespace carpool::test
