// bench-render: the wavefront against the megakernel and against bare Embree, side by side in one
// run.
#include <algorithm>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <iostream>

#include "render/session/workspace.h"
#include "tools/bench/replay.h"
#include "tools/bench/rows.h"

namespace carpool::tools {
namespace {

struct Options {
  std::vector<std::string> scenes;
  std::string environment, json;
  int width = 512, height = 512, samples = 4, rounds = 5, threads = 0;
  std::string isa = "auto";
  bool report = false;
};

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

render::RenderSettings SettingsFor(const Options& o, const std::string& scene,
                                   render::Executor executor) {
  render::RenderSettings s;
  s.scene_path = scene;
  s.env_path = o.environment;
  s.width = o.width;
  s.height = o.height;
  s.samples = o.samples;
  s.threads = o.threads;
  s.isa = render::ParseIsa(o.isa);
  s.executor = executor;
  return s;
}

/// Share of the workers' time that was not spent in kernels or sources, but deciding.
double SchedulerShare(const RunReport& r) {
  const double all = r.kernel_seconds + r.source_seconds + r.scheduler_seconds + r.idle_seconds;
  return all > 0 ? 100 * r.scheduler_seconds / all : 0;
}

void BenchScene(const Options& o, const std::string& scene, std::vector<Row>& rows) {
  render::Threads threads(o.threads);
  const std::string name = scene.substr(scene.find_last_of('/') + 1);
  threads.arena().execute([&] {
    const auto load = [&](render::Executor e) {
      const render::RenderSettings s = SettingsFor(o, scene, e);
      return std::make_unique<render::Workspace>(render::LoadScene(s, {}), s, threads);
    };
    const auto wave = load(render::Executor::wavefront), mega = load(render::Executor::megakernel);
    const std::atomic<bool> never{false};
    std::vector<double> ratios, wave_rays, mega_rays, replay_rays, shares;
    const RayLog log =
        RecordRays(wave->context(), wave->kernels(), static_cast<uint32_t>(o.samples));
    stages::PassReport last;
    for (int round = 0; round < o.rounds + 1; ++round) {
      const stages::CameraPass pass{.first_sample = 0,
                                    .sample_count = static_cast<uint32_t>(o.samples)};
      const stages::PassReport m = mega->executor().Render(pass, never, {});
      const stages::PassReport w = wave->executor().Render(pass, never, {});
      const double plain = Replay(wave->context().trace, log, false, threads.arena());
      const double sorted = Replay(wave->context().trace, log, true, threads.arena());
      if (round == 0) continue;  // warm-up
      ratios.push_back(m.seconds / w.seconds);
      wave_rays.push_back(static_cast<double>(w.rays.total()) / w.seconds / 1e6);
      mega_rays.push_back(static_cast<double>(m.rays.total()) / m.seconds / 1e6);
      replay_rays.push_back(static_cast<double>(log.total()) / std::min(plain, sorted) / 1e6);
      shares.push_back(SchedulerShare(w.schedule));
      last = w;
    }
    if (o.report) last.schedule.print(std::cout);
    const double ratio = Median(ratios), of_embree = Median(wave_rays) / Median(replay_rays),
                 share = Median(shares);
    const double mebibytes =
        static_cast<double>(last.state_bytes + last.schedule.peak_bytes) / (1 << 20);
    rows.push_back({name + ": wavefront over megakernel", ratio, "x", ">= 1", ratio >= 1});
    rows.push_back({name + ": wavefront", Median(wave_rays), "M rays/s", "", true});
    rows.push_back({name + ": megakernel", Median(mega_rays), "M rays/s", "", true});
    rows.push_back({name + ": bare Embree, same rays", Median(replay_rays), "M rays/s", "", true});
    rows.push_back(
        {name + ": wavefront over bare Embree", of_embree, "x", ">= 0.5", of_embree >= 0.5});
    rows.push_back({name + ": megakernel over bare Embree", Median(mega_rays) / Median(replay_rays),
                    "x", "", true});
    rows.push_back({name + ": scheduler share of worker time", share, "%", "< 3", share < 3});
    rows.push_back({name + ": path state and queues", mebibytes, "MiB", "<= 64", mebibytes <= 64});
  });
}

int Main(int argc, char** argv) {
  Options o;
  CLI::App app{
      "Renders scenes by wavefront and megakernel in turn and replays the same rays through bare "
      "Embree; medians."};
  app.add_option("scenes", o.scenes, "glTF files")->required();
  app.add_option("--env", o.environment, "environment map");
  app.add_option("--width", o.width, "pixels");
  app.add_option("--height", o.height, "pixels");
  app.add_option("--samples", o.samples, "samples per pixel of one round");
  app.add_option("--rounds", o.rounds, "rounds counted, after one warm-up");
  app.add_option("--threads", o.threads, "0: all");
  app.add_option("--isa", o.isa, "sse4, avx2, avx512 or auto");
  app.add_flag("--report", o.report, "also print the scheduler's report of the last round");
  app.add_option("--json", o.json, "also write the rows to this file");
  CLI11_PARSE(app, argc, argv);
  std::vector<Row> rows;
  try {
    for (const std::string& scene : o.scenes) BenchScene(o, scene, rows);
  } catch (const render::Error& error) {
    std::fprintf(stderr, "bench-render: %s\n", error.what());
    return static_cast<int>(error.code());
  }
  PrintRows(rows);
  if (!o.json.empty()) std::ofstream(o.json) << RowsJson(rows);
  return std::all_of(rows.begin(), rows.end(), [](const Row& row) { return row.holds; }) ? 0 : 1;
}

}  // namespace
}  // namespace carpool::tools

int main(int argc, char** argv) {
  return carpool::tools::Main(argc, argv);
}
