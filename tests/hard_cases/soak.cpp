// `soak`: the closed forms again and again with fresh seeds, turned and moved at random, for as
// long as one likes; then whether p-values were uniform, and the smallest bias that would have been
// seen.
#include <chrono>
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>

#include "tests/hard_cases/figures.h"
#include "tests/hard_cases/scenes.h"
#include "tests/render/session/render_once.h"

namespace carpool::test {
namespace {

constexpr int kSeeds = 16;

/// Puts everything, camera included, under one node with a random rotation and place, which no
/// image depends on.
void MoveAtRandom(SceneCase& scene, std::mt19937& rng) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> decade(0, 6);
  double q[4], length = 0;
  for (double& x : q) {
    x = normal(rng);
    length += x * x;
  }
  const double far = std::pow(10.0, decade(rng)) - 1;  // up to 1e6 m from the origin
  nlohmann::json& roots = scene.scene.json()["scenes"][0]["nodes"];
  const nlohmann::json children = roots;
  roots = nlohmann::json::array();
  nlohmann::json parent = {
      {"children", children},
      {"translation", {far * normal(rng), far * normal(rng), far * normal(rng)}},
      {"rotation", nlohmann::json::array()}};
  for (const double x : q) parent["rotation"].push_back(x / std::sqrt(length));
  scene.scene.AddNode(parent);
}

/// What the runs so far have shown.
struct Tally {
  std::vector<double> deciles = std::vector<double>(10);
  uint64_t runs = 0, failures = 0, faulty_samples = 0;
  double paths = 0, bias = 0, weight = 0;  // mean relative error, weighted by its precision
};

void RunOnce(ClosedForm form, std::mt19937& rng, Tally& tally) {
  if (form.scene.sky.width <= 1) MoveAtRandom(form.scene, rng);  // a sky stays where it is
  const ScratchFolder folder;
  render::RenderSettings settings = WriteCase(form.scene, folder.path());
  Mean mean;
  const uint32_t first = static_cast<uint32_t>(rng());
  for (int i = 0; i < kSeeds; ++i) {
    settings.seed = first + static_cast<uint32_t>(i);
    const Rendered rendered = RenderOnce(settings);
    tally.faulty_samples += rendered.summary.ledger.Count();
    tally.paths += static_cast<double>(rendered.summary.rays.camera);
    mean.Add(MeanOf(rendered.image, "G"));
  }
  const double scale = std::abs(form.claim.expected);
  const double p = MeanTail(mean, form.claim.expected, (form.claim.slack + kRounding) * scale);
  ++tally.runs;
  // One of ten thousand runs may well be below 1e-4; below 1e-9 none is by chance.
  if (p < 1e-9) {
    ++tally.failures;
    std::printf("FAILED %s: expected %.9g, measured %.9g +- %.2g, p = %.2g, seeds from %u\n",
                form.scene.name.c_str(), form.claim.expected, mean.Value(), mean.Error(), p, first);
  }
  const double error = mean.Error() / scale;
  if (form.claim.slack > 0 || error < 10 * kRounding) return;  // neither p nor error is pure noise
  ++tally.deciles[static_cast<size_t>(std::min(9.0, 10 * p))];
  tally.bias += (mean.Value() / form.claim.expected - 1) / (error * error);
  tally.weight += 1 / (error * error);
}

int Report(const Tally& tally, const std::string& json) {
  double counted = 0;
  for (const double n : tally.deciles) counted += n;
  const double uniformity =
      ChiSquaredTest(tally.deciles, std::vector<double>(10, std::max(counted, 1e-9) / 10));
  const double error = tally.weight > 0 ? 1 / std::sqrt(tally.weight) : 0;
  const double bias = tally.weight > 0 ? tally.bias / tally.weight : 0;
  std::vector<tools::Row> rows = {
      {"runs", static_cast<double>(tally.runs), "", "", true},
      {"paths", tally.paths, "", "", true},
      {"failed runs, p < 1e-9", static_cast<double>(tally.failures), "", "== 0",
       tally.failures == 0},
      {"samples in the ledger", static_cast<double>(tally.faulty_samples), "", "== 0",
       tally.faulty_samples == 0},
      {"uniformity of p-values", uniformity, "p", ">= 1e-6", uniformity >= kFalseAlarm},
      {"common relative bias", bias, "", "", true},
      {"smallest common bias that would be seen", (kLargestZ + 2.33) * error, "", "", true}};
  tools::PrintRows(rows);
  if (!json.empty()) std::ofstream(json) << tools::RowsJson(rows);
  for (const tools::Row& row : rows) {
    if (!row.holds) return 1;
  }
  return 0;
}

int Soak(int argc, char** argv) {
  CLI::App program("the closed forms with fresh seeds, turned and moved at random");
  double seconds = 60;
  uint32_t seed = std::random_device()();
  std::string json;
  program.add_option("--seconds", seconds, "how long (default: 60)");
  program.add_option("--seed", seed, "repeats a run (default: fresh)");
  program.add_option("--json", json, "also writes the figures as rows");
  CLI11_PARSE(program, argc, argv);
  std::printf("soak --seed %u\n", seed);

  std::mt19937 rng(seed);
  Tally tally;
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<ClosedForm>& forms = ClosedForms();
  do {
    RunOnce(forms[rng() % forms.size()], rng, tally);
  } while (std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() <
           seconds);
  return Report(tally, json);
}

}  // namespace
}  // namespace carpool::test

int main(int argc, char** argv) {
  return carpool::test::Soak(argc, argv);
}
