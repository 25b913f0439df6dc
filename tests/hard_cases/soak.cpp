// `soak`: the statistical cases again and again with fresh seeds, at random scales, places and
// brightnesses, and random scenes beside them, for as long as one likes; then whether p-values were
// uniform, and the smallest bias that would have been seen.
#include <chrono>
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>

#include "tests/hard_cases/figures.h"
#include "tests/hard_cases/model_run.h"
#include "tests/hard_cases/variations.h"
#include "tests/render/session/render_once.h"
#include "tests/support/evidence.h"

namespace carpool::test {
namespace {

constexpr int kSeeds = 16;
/// One of ten thousand runs may well be below 1e-4; below this none is by chance.
constexpr double kFailure = 1e-9;

/// What the runs so far have shown.
struct Tally {
  Evidence evidence;  // of the runs whose answer is exact, or nearly so beside their noise
  uint64_t runs = 0, failures = 0;
  uint64_t not_finite = 0, faulty = 0;  // samples
  double paths = 0;
};

class Soak {
 public:
  Soak(uint32_t seed, int effort, std::string keep, std::vector<std::string> files)
      : rng_(seed), effort_(effort), keep_(std::move(keep)), files_(std::move(files)) {}

  /// One case, whichever comes.
  void RunOne() {
    const uint32_t lot = rng_() % 1000;
    if (lot < 4) {
      RunForm(DomeOfLights(500, rng_));
    } else if (lot < 250) {
      RunForm(RandomFurnace(rng_));
    } else if (lot < 350) {
      RunForm(RandomWhiteSphere(rng_));
    } else if (lot < 500 && !files_.empty()) {
      RunFile(files_[rng_() % files_.size()]);
    } else if (lot < 600) {
      RunTwins(AllTwins()[rng_() % AllTwins().size()]);
    } else {
      RunForm(ClosedForms()[rng_() % ClosedForms().size()]);
    }
  }
  const Tally& tally() const { return tally_; }

 private:
  /// Green means of renders with seeds from `first` on, and what their ledgers say.
  Mean Estimate(const render::RenderSettings& usual, uint32_t first, const std::string& what) {
    render::RenderSettings settings = usual;
    Mean mean;
    for (uint32_t i = 0; i < kSeeds; ++i) {
      settings.seed = first + i;
      const Rendered rendered = RenderOnce(settings);
      Count(rendered.summary, what + ", seed " + std::to_string(settings.seed));
      mean.Add(MeanOf(rendered.image, "G"));
    }
    return mean;
  }

  void Count(const render::RenderSummary& summary, const std::string& what) {
    tally_.paths += static_cast<double>(summary.rays.camera);
    if (summary.ledger.Count() == 0) return;
    tally_.faulty += summary.ledger.Count();
    tally_.not_finite += summary.ledger.Of(stages::SampleFault::not_finite).count;
    std::printf("LEDGER %s: %llu samples\n", what.c_str(),
                static_cast<unsigned long long>(summary.ledger.Count()));
  }

  void RunForm(ClosedForm form) {
    const Variation v = Vary(form.scene, form.claim.expected, rng_);
    const double expected = form.claim.expected * v.brightness;
    form.scene.settings.samples *= effort_;
    const ScratchFolder folder;
    const uint32_t first = rng_();
    const std::string what = form.scene.name + " (" + v.Text() + ")";
    const Mean mean = Estimate(WriteCase(form.scene, folder.path()), first, what);
    // Half a step of the film is what a sample may be off.
    const double rounding = kRounding + 0x1p-33 / expected;
    const double p = MeanTail(mean, expected, (form.claim.slack + rounding) * expected);
    if (!Judge(what, p, expected, mean, first)) Keep(folder, form.scene.name);
    const double error = mean.Error() / expected;
    if (IsEvidence(form.claim, error, rounding)) tally_.evidence.Add(mean, expected);
  }

  /// Is the answer exact beside the noise? What is off by a third of the standard error moves no
  /// share of p-values by more than 0.03.
  static bool IsEvidence(const Claim& claim, double error, double rounding) {
    return claim.slack <= 1e-5 && error >= 3 * rounding;
  }

  void RunTwins(Twins twins) {
    Mean means[2];
    std::string what;
    double brightness[2];
    const uint32_t first = rng_();
    for (int i = 0; i < 2; ++i) {
      SceneCase& scene = i == 0 ? twins.a : twins.b;
      // Row 46 has scales of its own.
      const bool vary = twins.row != 46;
      const Variation v = vary ? Vary(scene, 1, rng_) : Variation{};
      brightness[i] = v.brightness;
      what += (i == 0 ? "" : " = ") + scene.name + " (" + v.Text() + ")";
      const ScratchFolder folder;
      means[i] =
          Estimate(WriteCase(scene, folder.path()), first + 1000 * static_cast<uint32_t>(i), what)
              .Scaled(1 / brightness[i]);
    }
    means[1] = means[1].Scaled(twins.scale);
    const double step = 0x1p-33 / std::min(brightness[0], brightness[1]);
    const double slack = (twins.claim.slack + kRounding) * std::abs(means[0].Value()) + step;
    const double p = WelchTail(means[0], means[1], slack);
    Judge(what, p, means[0].Value(), means[1], first);
    const double value = std::abs(means[0].Value());
    const double error = std::hypot(means[0].Error(), means[1].Error()) / value;
    if (IsEvidence(twins.claim, error, kRounding + step / value))
      tally_.evidence.Add(WelchTail(means[0], means[1], 0));
  }

  /// A scene whose image nobody knows: its samples are counted.
  void RunFile(const std::string& path) {
    render::RenderSettings settings = HardSettings(64 * effort_, 8);
    settings.width = settings.height = 64;
    settings.scene_path = path;
    settings.seed = rng_();
    Count(RenderOnce(settings).summary, path + ", seed " + std::to_string(settings.seed));
    ++tally_.runs;
  }

  /// False if that was no chance.
  bool Judge(const std::string& what, double p, double expected, const Mean& mean, uint32_t first) {
    ++tally_.runs;
    if (p >= kFailure) return true;
    ++tally_.failures;
    std::printf("FAILED %s: expected %.9g, measured %.9g +- %.2g, p = %.2g, seeds from %u\n",
                what.c_str(), expected, mean.Value(), mean.Error(), p, first);
    return false;
  }

  /// Saves the files of a scene that failed, to be rendered again.
  void Keep(const ScratchFolder& folder, const std::string& name) const {
    if (keep_.empty()) return;
    const std::filesystem::path to =
        std::filesystem::path(keep_) / (std::to_string(tally_.runs) + "_" + name);
    std::filesystem::create_directories(to);
    std::filesystem::copy(folder.path(), to,
                          std::filesystem::copy_options::overwrite_existing |
                              std::filesystem::copy_options::recursive);
    std::printf("       its files are in %s\n", to.c_str());
  }

  std::mt19937 rng_;
  int effort_;
  std::string keep_;
  std::vector<std::string> files_;
  Tally tally_;
};

std::vector<tools::Row> Rows(const Tally& tally) {
  const Evidence& e = tally.evidence;
  const auto n = static_cast<double>(e.count());
  const double distance = e.count() > 0 ? DistanceFromUniform(e.p_values()) : 0;
  return {
      {"runs", static_cast<double>(tally.runs), "", "", true},
      {"paths", tally.paths, "", "", true},
      {"failed runs, p < 1e-9", static_cast<double>(tally.failures), "", "== 0",
       tally.failures == 0},
      {"samples that are not finite", static_cast<double>(tally.not_finite), "", "== 0",
       tally.not_finite == 0},
      {"samples in the ledger", static_cast<double>(tally.faulty), "", "== 0", tally.faulty == 0},
      {"p-values, of runs whose answer is exact", n, "", "", true},
      {"their distance from uniform (Kolmogorov)", distance, "", "", true},
      {"its p", e.count() > 0 ? KolmogorovTail(distance, n) : 1, "", ">= 1e-6", e.IsUniform()},
      {"smallest distance that would be seen", e.SmallestDistance(), "", "", true},
      {"bias common to them", 1e6 * e.CommonBias(), "ppm", "5 s.e.", e.IsUnbiased(kRounding)},
      {"its standard error", 1e6 * e.CommonError(), "ppm", "", true},
      {"smallest common bias that would be seen", 1e6 * e.SmallestCommonBias(), "ppm", "", true},
      {"smallest bias of one run that would be seen, median", 1e6 * e.SmallestSingleBias(), "ppm",
       "", true}};
}

int Report(const std::vector<tools::Row>& rows, const std::string& json) {
  tools::PrintRows(rows);
  if (!json.empty()) std::ofstream(json) << tools::RowsJson(rows);
  for (const tools::Row& row : rows) {
    if (!row.holds) return 1;
  }
  return 0;
}

int Main(int argc, char** argv) {
  CLI::App program("the statistical cases with fresh seeds, scaled, moved and lit at random");
  double seconds = 60;
  uint32_t seed = std::random_device()();
  int effort = 1;
  std::string json, keep;
  std::vector<std::string> files;
  ModelRun models;
  program.add_option("--seconds", seconds, "how long (default: 60)");
  program.add_option("--seed", seed, "repeats a run (default: fresh)");
  program.add_option("--effort", effort, "multiplies the samples of the suite (default: 1)");
  program.add_option("--json", json, "also writes the figures as rows");
  program.add_option("--keep", keep, "folder for the scenes of closed forms that fail");
  program.add_option("files", files, "glTF files whose samples are to be counted, too");
  program.add_option("--models", models.folders,
                     "instead: folders whose scenes are rendered in turn, to count their samples");
  program.add_option("--sky", models.skies, "with --models: render under this map, too");
  program.add_option("--paths", models.paths, "with --models: how many (default: 1e9)");
  CLI11_PARSE(program, argc, argv);
  std::printf("soak --seed %u\n", seed);
  std::fflush(stdout);
  if (!models.folders.empty()) {
    models.seed = seed;
    return Report(RowsOf(CountSamples(models)), json);
  }

  Soak soak(seed, effort, keep, files);
  const auto begin = std::chrono::steady_clock::now();
  do {
    soak.RunOne();
    std::fflush(stdout);
  } while (std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() <
           seconds);
  return Report(Rows(soak.tally()), json);
}

}  // namespace
}  // namespace carpool::test

int main(int argc, char** argv) {
  return carpool::test::Main(argc, argv);
}
