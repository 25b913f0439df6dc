// Everything that is measured of one scene: executors in turn, bare Embree, prices, threads,
// ladder.
#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "carpool/report.h"
#include "render/ladder/ladder.h"
#include "tools/bench/rows.h"

namespace carpool::tools {

struct SceneCase {
  std::string label;  // as shown
  std::string path;   // glTF
  std::string environment;
  std::string camera;
};

struct BenchOptions {
  int width = 512, height = 512;
  int samples = 0;  // a round; 0: 4 to 16, so that the wavefront takes about half a second
  int rounds = 5;   // counted, after one to warm up
  int threads = 0;  // 0: all
  std::string isa = "auto";
  bool scaling = false;  // also fewer threads
  bool ladder = false;   // also the ladder, 256x256
};

/// Wall-clock figures are medians over the rounds, in each of which everything runs once, in turn.
struct SceneFigures {
  SceneCase scene;
  std::string isa;
  int threads = 0, samples = 0;
  double load_seconds = 0, bvh_seconds = 0;    // load: everything before the BVH
  double wave = 0, mega = 0;                   // M rays/s
  double embree_plain = 0, embree_sorted = 0;  // M rays/s of the same rays in bare Embree ...
  double embree_packets = 0, embree_sorted_packets = 0;  // ... and in packets
  // Speeds over one another, medians of what each round gave.
  double over_singles = 0;  // wavefront / the faster of bare Embree's single rays, sorted or not
  double over_embree = 0;   // ... / the fastest of its four ways
  double mega_over_embree = 0;
  double over_mega = 0;                            // wavefront / megakernel
  double least_over_mega = 0, most_over_mega = 0;  // of all rounds
  double robust_price = 0;     // seconds with Embree's ROBUST flag / without, wavefront
  double film_price = 0;       // exact sums instead of floats, as a share of the wavefront's time
  double shading_gain = 0;     // time of the shading stage at one lane / at full width
  double scheduler_share = 0;  // of worker time, 0..1
  double idle_share = 0;
  double mebibytes = 0;  // path state and queues
  double bvh_mebibytes = 0, film_mebibytes = 0;
  std::vector<std::pair<int, double>> scaling;  // threads, speed over one thread
  RunReport schedule;                           // of the wavefront's last round
  std::optional<render::LadderReport> ladder;
};

/// Throws render::Error where the scene cannot be loaded.
SceneFigures BenchScene(const SceneCase& scene, const BenchOptions& options);

/// The figures as rows, with the targets that they are held against.
std::vector<Row> RowsOf(const SceneFigures& figures);

/// Rows over all scenes: geometric means. None for a single scene.
std::vector<Row> SummaryRows(const std::vector<SceneFigures>& scenes);

}  // namespace carpool::tools
