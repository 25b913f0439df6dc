// bench-render: the wavefront against the megakernel and against bare Embree, side by side in one
// run.
#include <algorithm>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "render/base/error.h"
#include "tools/bench/page.h"
#include "tools/bench/suite.h"

namespace carpool::tools {
namespace {

struct Flags {
  std::vector<std::string> scenes;
  std::string environment, camera;
  std::string own, models, generated;  // folders of the suite
  std::string only;
  BenchOptions bench;
  bool report = false;
  std::string json, html;
};

std::vector<SceneCase> CasesOf(const Flags& flags) {
  std::vector<SceneCase> cases;
  if (!flags.own.empty()) cases = SuiteCases(flags.own, flags.models, flags.generated);
  for (const std::string& path : flags.scenes) {
    cases.push_back(
        {std::filesystem::path(path).filename().string(), path, flags.environment, flags.camera});
  }
  std::erase_if(cases,
                [&](const SceneCase& c) { return c.label.find(flags.only) == std::string::npos; });
  return cases;
}

void Write(const std::string& path, const std::string& text) {
  if (path.empty()) return;
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw render::Error(render::ExitCode::output_failed, path + ": cannot be written");
}

void AddFlags(CLI::App& app, Flags& flags) {
  app.add_option("scenes", flags.scenes, "glTF files");
  app.add_option("--env", flags.environment, "environment map of these files");
  app.add_option("--camera", flags.camera, "camera of these files");
  CLI::Option* const suite =
      app.add_option("--suite", flags.own, "the fixed set: this project's folder of scenes ...");
  app.add_option("--models", flags.models, "... the folder of glTF models by others ...")
      ->needs(suite);
  app.add_option("--generated", flags.generated, "... and that of what generate-scenes made")
      ->needs(suite);
  app.add_option("--only", flags.only, "scenes with this in their name");
  app.add_option("--width", flags.bench.width, "pixels");
  app.add_option("--height", flags.bench.height, "pixels");
  app.add_option("--samples", flags.bench.samples,
                 "samples per pixel of one round; 0: 4 to 16, about half a second");
  app.add_option("--rounds", flags.bench.rounds, "rounds counted, after one warm-up");
  app.add_option("--threads", flags.bench.threads, "0: all");
  app.add_option("--isa", flags.bench.isa, "sse4, avx2, avx512 or auto");
  app.add_flag("--scaling", flags.bench.scaling, "also measure fewer threads");
  app.add_flag("--ladder", flags.bench.ladder, "also climb the ladder, at 256x256");
  app.add_flag("--report", flags.report, "also print the scheduler's report of the last round");
  app.add_option("--json", flags.json, "also write the rows to this file");
  app.add_option("--html", flags.html, "also write a page to this file");
}

int Measure(const Flags& flags) {
  std::vector<SceneFigures> scenes;
  std::vector<Row> rows;
  std::vector<std::string> skipped;
  const std::vector<SceneCase> cases = CasesOf(flags);
  if (cases.empty()) {
    throw render::Error(render::ExitCode::usage, "no scene is named; see --help");
  }
  for (const SceneCase& scene : cases) {
    const bool of_suite = !flags.own.empty();
    if (of_suite && !std::filesystem::exists(scene.path)) {
      skipped.push_back(scene.label + ": skipped, there is no " + scene.path);
      std::printf("%s\n", skipped.back().c_str());
      continue;
    }
    scenes.push_back(BenchScene(scene, flags.bench));
    if (flags.report) scenes.back().schedule.print(std::cout);
    const std::vector<Row> of_scene = RowsOf(scenes.back());
    PrintRows(of_scene);
    std::fflush(stdout);
    rows.insert(rows.end(), of_scene.begin(), of_scene.end());
    // After each scene, so that a run that is cut short leaves what it has.
    Write(flags.html, Page(flags.bench, scenes, skipped));
  }
  const std::vector<Row> summary = SummaryRows(scenes);
  PrintRows(summary);
  rows.insert(rows.end(), summary.begin(), summary.end());
  Write(flags.json, RowsJson(rows));
  Write(flags.html, Page(flags.bench, scenes, skipped));
  return std::all_of(rows.begin(), rows.end(), [](const Row& row) { return row.holds; }) ? 0 : 1;
}

int Main(int argc, char** argv) {
  Flags flags;
  CLI::App app{
      "Renders scenes by wavefront and megakernel in turn and replays the same rays through bare "
      "Embree; medians. The exit code is 0 if all targets hold, 1 if not."};
  AddFlags(app, flags);
  CLI11_PARSE(app, argc, argv);
  try {
    return Measure(flags);
  } catch (const render::Error& error) {
    std::fprintf(stderr, "bench-render: %s\n", error.what());
    return static_cast<int>(error.code());
  }
}

}  // namespace
}  // namespace carpool::tools

int main(int argc, char** argv) {
  return carpool::tools::Main(argc, argv);
}
