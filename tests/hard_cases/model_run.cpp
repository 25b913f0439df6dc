// Renders folders of scenes again and again, and adds up their ledgers.
#include "tests/hard_cases/model_run.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <random>
#include <set>

#include "render/posix/interrupt.h"
#include "tests/hard_cases/scene_case.h"

namespace carpool::test {
namespace {

namespace fs = std::filesystem;

constexpr int kSide = 64;      // pixels
constexpr int kSamples = 128;  // a render has 2^19 paths: many rounds, and seeds, for each scene
constexpr std::array<const char*, stages::kSampleFaults> kFaults = {"not finite", "too large",
                                                                    "negative", "clamped"};

struct Job {
  std::string scene, sky;  // files; no sky: empty
  std::string Text() const { return scene + (sky.empty() ? "" : " --env " + sky); }
};

std::set<std::string> ScenesBelow(const std::vector<std::string>& folders) {
  std::set<std::string> scenes;
  for (const std::string& folder : folders) {
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      const auto extension = entry.path().extension();
      if (extension == ".gltf" || extension == ".glb") scenes.insert(entry.path().string());
    }
  }
  return scenes;
}

std::vector<Job> JobsOf(const std::set<std::string>& scenes,
                        const std::vector<std::string>& skies) {
  std::vector<Job> jobs;
  for (const std::string& scene : scenes) {
    jobs.push_back({scene, ""});
    for (const std::string& sky : skies) jobs.push_back({scene, sky});
  }
  return jobs;
}

void Count(const stages::SampleLedger& ledger, const Job& job, uint32_t seed, ModelTally& tally) {
  for (size_t i = 0; i < kFaults.size(); ++i) {
    const stages::SampleLedger::Entry& entry = ledger.entries[i];
    tally.faults[i] += entry.count;
    if (entry.count == 0) continue;
    std::printf(
        "LEDGER %llu samples %s; the first: carpool render %s --size %dx%d --seed %u "
        "--pixel %u,%u --sample %u --explain\n",
        static_cast<unsigned long long>(entry.count), kFaults[i], job.Text().c_str(), kSide, kSide,
        seed, entry.pixel % kSide, entry.pixel / kSide, entry.sample);
    std::fflush(stdout);
  }
}

/// One render. False if the file is refused, which is said.
bool RenderJob(const Job& job, uint32_t seed, const std::atomic<bool>& stop, ModelTally& tally) {
  const ScratchFolder folder;
  const render::RenderSettings settings{.scene_path = job.scene,
                                        .env_path = job.sky,
                                        .output_path = (folder.path() / "image.exr").string(),
                                        .write_png = false,
                                        .width = kSide,
                                        .height = kSide,
                                        .samples = kSamples,
                                        .seed = seed};
  try {
    const render::RenderSummary summary = render::Render(settings, stop, {}, {});
    Count(summary.ledger, job, seed, tally);
    tally.paths += static_cast<double>(summary.rays.camera);
    ++tally.renders;
    return true;
  } catch (const render::Error& error) {
    std::printf("refused: %s\n", error.what());
    return false;
  }
}

}  // namespace

ModelTally CountSamples(const ModelRun& run) {
  const render::InterruptGuard interrupt;
  std::mt19937 seeds(run.seed);
  const std::set<std::string> scenes = ScenesBelow(run.folders);
  std::vector<Job> jobs = JobsOf(scenes, run.skies);
  std::set<std::string> refused;
  ModelTally tally;
  tally.scenes = scenes.size();
  const auto begin = std::chrono::steady_clock::now();
  while (tally.paths < run.paths && refused.size() < scenes.size() && !interrupt.Requested()) {
    std::shuffle(jobs.begin(), jobs.end(), seeds);  // so that a run cut short saw some of each kind
    for (const Job& job : jobs) {
      if (tally.paths >= run.paths || interrupt.Requested()) break;
      if (refused.contains(job.scene)) continue;
      if (!RenderJob(job, seeds(), interrupt.Requested(), tally)) refused.insert(job.scene);
      tally.seconds =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      std::fprintf(stderr, "%.4g of %.4g paths, %.0f s; done: %s\n", tally.paths, run.paths,
                   tally.seconds, job.Text().c_str());
    }
  }
  tally.refused = refused.size();
  return tally;
}

std::vector<tools::Row> RowsOf(const ModelTally& tally) {
  std::vector<tools::Row> rows = {{"scenes", static_cast<double>(tally.scenes), "", "", true},
                                  {"refused", static_cast<double>(tally.refused), "", "", true},
                                  {"renders", static_cast<double>(tally.renders), "", "", true},
                                  {"camera paths", tally.paths, "", "", true},
                                  {"time", tally.seconds, "s", "", true}};
  for (size_t i = 0; i < kFaults.size(); ++i) {
    rows.push_back({std::string("samples ") + kFaults[i], static_cast<double>(tally.faults[i]), "",
                    "== 0", tally.faults[i] == 0});
  }
  return rows;
}

}  // namespace carpool::test
