// bench-estimators: what the light tree and multiple importance sampling are worth, as error after
// equal time.
#include <algorithm>
#include <chrono>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "render/film/resolve.h"
#include "render/session/workspace.h"
#include "tools/bench/rows.h"
#include "tools/bench/scene_bench.h"

namespace carpool::tools {
namespace {

using render::DirectLight;
using render::LightChoice;
using render::RenderSettings;
using render::RgbPlane;

struct Flags {
  std::vector<std::string> scenes;
  std::string environment, camera, models, generated, json;
  int width = 512, height = 512, threads = 0;
  double seconds = 60;
};

struct Estimator {
  const char* name;
  DirectLight direct;
  LightChoice lights;
};
constexpr Estimator kBest = {"light tree and MIS", DirectLight::mis, LightChoice::tree};
// The simplest one that is right: to hit lights by chance, or where some cannot be hit, to choose
// any of them. The tree would only cost it time.
constexpr Estimator kByChance = {"lights met by chance", DirectLight::bsdf, LightChoice::uniform};
constexpr Estimator kAnyLight = {"any light, light sampling alone", DirectLight::light,
                                 LightChoice::uniform};
constexpr Estimator kBetween[] = {
    {"any light, MIS", DirectLight::mis, LightChoice::uniform},
    {"light tree, light sampling alone", DirectLight::light, LightChoice::tree}};

struct Result {
  RgbPlane image;
  double seconds = 0;
  uint32_t samples = 0;
  bool lights_have_size = true;  // none is a point, a spot or directional
};

/// Passes until the time is up, at least one.
Result RenderFor(const RenderSettings& settings, double seconds) {
  render::Threads threads(settings.threads);
  Result result;
  threads.arena().execute([&] {
    render::Workspace w(render::LoadScene(settings, {}), settings, threads);
    const std::atomic<bool> never{false};
    do {
      const double each = result.samples > 0 ? result.seconds / result.samples : seconds;
      const double fitting = std::min((seconds - result.seconds) / each, seconds / 10 / each);
      const uint32_t count = static_cast<uint32_t>(std::clamp(fitting, 1.0, 4096.0));
      result.seconds +=
          w.executor()
              .Render({.first_sample = result.samples, .sample_count = count}, never, {})
              .seconds;
      result.samples += count;
    } while (result.seconds < 0.98 * seconds);
    result.image = render::ResolveBeauty(w.film());
    const auto has_size = [](const stages::Light& light) { return stages::IsTriangle(light.type); };
    const auto& lights = w.scene().tables.lights.lights;
    result.lights_have_size = std::all_of(lights.begin(), lights.end(), has_size);
  });
  return result;
}

/// Mean squared error over squared value, with a hundredth of the mean against division by black.
double RelativeError(const RgbPlane& image, const RgbPlane& reference) {
  double mean = 0, sum = 0;
  for (const float v : reference) mean += v / static_cast<double>(reference.size());
  for (size_t i = 0; i < image.size(); ++i) {
    const double difference = double{image[i]} - reference[i];
    sum += difference * difference / (double{reference[i]} * reference[i] + 1e-4 * mean * mean);
  }
  return sum / static_cast<double>(image.size());
}

void Measure(const SceneCase& scene, const Flags& flags, std::vector<Row>& rows) {
  RenderSettings settings;
  settings.scene_path = scene.path;
  settings.env_path = scene.environment;
  settings.camera = scene.camera;
  settings.width = flags.width;
  settings.height = flags.height;
  settings.threads = flags.threads;
  settings.executor = render::Executor::wavefront;
  settings.seed = 1000;
  const Result reference = RenderFor(settings, 8 * flags.seconds);
  settings.seed = 1;
  const auto error_of = [&](const Estimator& e) {
    settings.direct = e.direct;
    settings.lights = e.lights;
    const Result result = RenderFor(settings, flags.seconds);
    // The last pass may end late; error falls as 1 / time.
    const double error =
        RelativeError(result.image, reference.image) * result.seconds / flags.seconds;
    const std::string name = scene.label + ": " + e.name;
    rows.push_back({name + ", relMSE", error, "", "", true});
    rows.push_back({name + ", samples", static_cast<double>(result.samples), "", "", true});
    return error;
  };
  const double best = error_of(kBest);
  const auto compare = [&](const Estimator& e, const char* target, double least) {
    const double ratio = error_of(e) / best;
    rows.push_back(
        {scene.label + ": " + e.name + ", over the best's", ratio, "x", target, ratio >= least});
  };
  if (reference.lights_have_size) compare(kByChance, ">= 5", 5);
  compare(kAnyLight, reference.lights_have_size ? "" : ">= 5", reference.lights_have_size ? 0 : 5);
  for (const Estimator& e : kBetween) compare(e, "", 0);
}

std::vector<SceneCase> CasesOf(const Flags& flags) {
  std::vector<SceneCase> cases;
  for (const std::string& path : flags.scenes) {
    cases.push_back(
        {std::filesystem::path(path).filename().string(), path, flags.environment, flags.camera});
  }
  if (!cases.empty()) return cases;
  const std::string sky = flags.models + "/env/qwantani_afternoon_puresky_1k.hdr";
  return {
      {"Sponza", flags.models + "/Sponza/Sponza.gltf", sky, "0"},
      {"LightsPunctualLamp", flags.models + "/LightsPunctualLamp/LightsPunctualLamp.gltf", "", ""},
      {"100,000 lights", flags.generated + "/lights.glb", "", ""}};
}

int Run(const Flags& flags) {
  std::vector<Row> all;
  for (const SceneCase& scene : CasesOf(flags)) {
    if (flags.scenes.empty() && !std::filesystem::exists(scene.path)) {
      std::printf("%s: skipped, there is no %s\n", scene.label.c_str(), scene.path.c_str());
      continue;
    }
    std::vector<Row> rows;
    Measure(scene, flags, rows);
    PrintRows(rows);
    std::fflush(stdout);
    all.insert(all.end(), rows.begin(), rows.end());
  }
  if (!flags.json.empty()) std::ofstream(flags.json) << RowsJson(all);
  return std::all_of(all.begin(), all.end(), [](const Row& row) { return row.holds; }) ? 0 : 1;
}

int Main(int argc, char** argv) {
  Flags flags;
  CLI::App app{
      "Renders scenes for equal times with and without light tree and MIS and prints the errors."};
  app.add_option("scenes", flags.scenes, "glTF files (default: a fixed set)");
  app.add_option("--env", flags.environment, "environment map of these files");
  app.add_option("--camera", flags.camera, "camera of these files");
  app.add_option("--models", flags.models, "folder of glTF models by others, for the fixed set");
  app.add_option("--generated", flags.generated, "folder of what generate-scenes made, likewise");
  app.add_option("--width", flags.width, "pixels");
  app.add_option("--height", flags.height, "pixels");
  app.add_option("--threads", flags.threads, "0: all");
  app.add_option("--seconds", flags.seconds,
                 "of each estimator; the reference takes eight times this");
  app.add_option("--json", flags.json, "also write the rows to this file");
  CLI11_PARSE(app, argc, argv);
  try {
    return Run(flags);
  } catch (const render::Error& error) {
    std::fprintf(stderr, "bench-estimators: %s\n", error.what());
    return static_cast<int>(error.code());
  }
}

}  // namespace
}  // namespace carpool::tools

int main(int argc, char** argv) {
  return carpool::tools::Main(argc, argv);
}
