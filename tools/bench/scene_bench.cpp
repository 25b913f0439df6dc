// Measures one scene: each round runs everything once, in turn, so that all see the same machine.
#include "tools/bench/scene_bench.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "render/session/workspace.h"
#include "tools/bench/film_price.h"
#include "tools/bench/replay.h"

namespace carpool::tools {
namespace {

using render::Executor;

render::RenderSettings SettingsFor(const SceneCase& scene, const BenchOptions& o) {
  render::RenderSettings s;
  s.scene_path = scene.path;
  s.env_path = scene.environment;
  s.camera = scene.camera;
  s.width = o.width;
  s.height = o.height;
  s.threads = o.threads;
  s.isa = render::ParseIsa(o.isa);
  s.executor = Executor::wavefront;
  return s;
}

/// A part of the workers' time, which is spent in kernels, sources, deciding and waiting.
double ShareOf(const RunReport& r, double seconds) {
  const double all = r.kernel_seconds + r.source_seconds + r.scheduler_seconds + r.idle_seconds;
  return all > 0 ? seconds / all : 0;
}

/// Seconds per item of the shading stage.
double ShadingCost(const RunReport& r) {
  for (const StageReport& stage : r.stages) {
    if (stage.name == "shade" && stage.items > 0)
      return stage.kernel_seconds / static_cast<double>(stage.items);
  }
  return 0;
}

/// Seconds and rays of one executor over the rounds.
struct Track {
  stages::Executor& executor;
  std::vector<double> seconds = {}, mega_rays = {};
  stages::PassReport last = {};

  void Run(const stages::CameraPass& pass, bool counts) {
    const std::atomic<bool> never{false};
    last = executor.Render(pass, never, {});
    if (!counts) return;
    seconds.push_back(last.seconds);
    mega_rays.push_back(static_cast<double>(last.rays.total()) / last.seconds / 1e6);
  }
};

/// Samples of a round: those asked for, or as many as fill about half a second. What begins and
/// ends a pass should not count, nor the log of its rays outgrow the memory.
uint32_t SamplesOf(const BenchOptions& o, stages::Executor& wavefront) {
  if (o.samples > 0) return static_cast<uint32_t>(o.samples);
  constexpr uint32_t kFew = 4, kMany = 16;
  Track probe{wavefront};
  for (int i = 0; i < 2; ++i) probe.Run({.sample_count = kFew}, i > 0);
  const double fours = std::ceil(0.5 / probe.last.seconds);
  return std::min(kMany, kFew * static_cast<uint32_t>(std::min(fours, 4.0)));
}

/// The speeds of one executor or way of replaying, by round.
using Speeds = std::vector<double>;

/// Median over the rounds of a's speed over b's.
double Ratio(const Speeds& a, const Speeds& b) {
  Speeds ratios;
  for (size_t i = 0; i < a.size(); ++i) ratios.push_back(a[i] / b[i]);
  return Median(ratios);
}

/// The one with the highest median.
const Speeds& Fastest(std::span<const Speeds> ways) {
  return *std::ranges::max_element(ways, {}, [](const Speeds& way) { return Median(way); });
}

void MeasureRounds(const BenchOptions& o, render::Workspace& w, render::Workspace& loose,
                   const stages::ExecutorOptions& options, SceneFigures& f) {
  const auto megakernel = stages::MakeMegakernel(w.context(), w.kernels(), options);
  stages::ExecutorOptions narrow = options;
  narrow.simd = false;
  const auto one_lane =
      stages::MakeWavefront(w.context(), w.kernels(), w.scene().tables.geometry.placements, narrow);
  Track wave{w.executor()}, mega{*megakernel}, fast{loose.executor()}, one{*one_lane};
  const stages::CameraPass pass{.sample_count = SamplesOf(o, w.executor())};
  f.samples = static_cast<int>(pass.sample_count);
  const RayLog log = RecordRays(w.context(), w.kernels(), pass.sample_count);
  std::array<Speeds, 4> embree;  // single rays as they came and sorted, packets likewise
  Speeds over_mega, price, gain, share, idle;
  const auto speed = [&](double seconds) {
    return static_cast<double>(log.total()) / seconds / 1e6;
  };
  for (int round = 0; round < o.rounds + 1; ++round) {
    for (Track* track : {&mega, &wave, &one, &fast}) track->Run(pass, round > 0);
    const auto replay = [&](bool packets, bool in_windows) {
      return speed(Replay(w.context().trace, log, {packets, in_windows}, *options.arena));
    };
    const double replays[4] = {replay(false, false), replay(false, true), replay(true, false),
                               replay(true, true)};
    if (round == 0) continue;
    for (size_t way = 0; way < embree.size(); ++way) embree[way].push_back(replays[way]);
    over_mega.push_back(mega.last.seconds / wave.last.seconds);
    gain.push_back(ShadingCost(one.last.schedule) / ShadingCost(wave.last.schedule));
    price.push_back(wave.last.seconds / fast.last.seconds);
    const RunReport& r = wave.last.schedule;
    share.push_back(ShareOf(r, r.scheduler_seconds));
    idle.push_back(ShareOf(r, r.idle_seconds));
  }
  f.wave = Median(wave.mega_rays);
  f.mega = Median(mega.mega_rays);
  f.embree_plain = Median(embree[0]);
  f.embree_sorted = Median(embree[1]);
  f.embree_packets = Median(embree[2]);
  f.embree_sorted_packets = Median(embree[3]);
  f.over_singles = Ratio(wave.mega_rays, Fastest(std::span(embree).first(2)));
  f.over_embree = Ratio(wave.mega_rays, Fastest(embree));
  f.mega_over_embree = Ratio(mega.mega_rays, Fastest(embree));
  f.over_mega = Median(over_mega);
  f.least_over_mega = *std::min_element(over_mega.begin(), over_mega.end());
  f.most_over_mega = *std::max_element(over_mega.begin(), over_mega.end());
  f.robust_price = Median(price);
  f.shading_gain = Median(gain);
  const FilmPrice film = MeasureFilmPrice(w.context().width, w.context().height, *options.arena);
  const double samples = static_cast<double>(log.samples);
  f.film_price = (film.exact - film.floats) * 1e-9 * samples / (Median(wave.seconds) * f.threads);
  f.scheduler_share = Median(share);
  f.idle_share = Median(idle);
  f.schedule = wave.last.schedule;
  f.mebibytes = static_cast<double>(wave.last.state_bytes + f.schedule.peak_bytes) / (1 << 20);
}

/// Speed of the wavefront on 1, 2, 4 ... threads over one, all in turn.
void MeasureScaling(const render::RenderSettings& settings, const BenchOptions& o,
                    render::Workspace& w, int most, SceneFigures& f) {
  std::vector<int> counts;
  for (int n = 1; n < most; n *= 2) counts.push_back(n);
  counts.push_back(most);
  const stages::CameraPass pass{.sample_count = static_cast<uint32_t>(f.samples)};
  std::vector<std::vector<double>> seconds(counts.size());
  for (int round = 0; round < o.rounds; ++round) {
    for (size_t i = 0; i < counts.size(); ++i) {
      render::Threads threads(counts[i]);
      const auto wavefront =
          stages::MakeWavefront(w.context(), w.kernels(), w.scene().tables.geometry.placements,
                                render::ExecutorOptionsFor(settings, threads));
      Track track{*wavefront};
      track.Run(pass, true);
      seconds[i].push_back(track.last.seconds);
    }
  }
  for (size_t i = 0; i < counts.size(); ++i)
    f.scaling.emplace_back(counts[i], Median(seconds[0]) / Median(seconds[i]));
}

render::LadderReport Climb(render::RenderSettings settings) {
  settings.width = settings.height = 256;
  settings.samples = 16;
  const std::atomic<bool> never{false};
  return render::RunLadder(settings, {.rounds = 3, .serial_seconds = 30}, never, {}, {});
}

}  // namespace

SceneFigures BenchScene(const SceneCase& scene, const BenchOptions& options) {
  SceneFigures f;
  f.scene = scene;
  const render::RenderSettings settings = SettingsFor(scene, options);
  {
    render::Threads threads(options.threads);
    f.threads = threads.count();
    threads.arena().execute([&] {
      render::RenderSettings loose_settings = settings;
      loose_settings.robust = false;
      render::Workspace w(render::LoadScene(settings, {}), settings, threads);
      render::Workspace loose(render::LoadScene(loose_settings, {}), loose_settings, threads);
      const render::LoadTimes& times = w.scene().times;
      f.load_seconds = times.import + times.textures + times.geometry + times.lights;
      f.bvh_seconds = w.bvh().seconds();
      f.bvh_mebibytes = static_cast<double>(w.bvh().bytes()) / (1 << 20);
      f.film_mebibytes = static_cast<double>(w.film().bytes()) / (1 << 20);
      f.isa = w.kernels().isa;
      MeasureRounds(options, w, loose, render::ExecutorOptionsFor(settings, threads), f);
      if (options.scaling) MeasureScaling(settings, options, w, f.threads, f);
    });
  }
  if (options.ladder) f.ladder = Climb(settings);
  return f;
}

std::vector<Row> RowsOf(const SceneFigures& f) {
  std::vector<Row> rows;
  const auto add = [&](const char* name, double value, const char* unit, const char* target = "",
                       bool holds = true) {
    rows.push_back({f.scene.label + ": " + name, value, unit, target, holds});
  };
  add("samples per pixel of a round", f.samples, "");
  add("wavefront over megakernel", f.over_mega, "x", ">= 1", f.over_mega >= 1);
  add("wavefront", f.wave, "M rays/s");
  add("megakernel", f.mega, "M rays/s");
  add("bare Embree, rays as they came", f.embree_plain, "M rays/s");
  add("bare Embree, rays sorted", f.embree_sorted, "M rays/s");
  add("bare Embree, packets as they came", f.embree_packets, "M rays/s");
  add("bare Embree, packets of sorted rays", f.embree_sorted_packets, "M rays/s");
  add("wavefront over bare Embree's single rays", f.over_singles, "x");
  add("wavefront over bare Embree", f.over_embree, "x", ">= 0.5", f.over_embree >= 0.5);
  add("megakernel over bare Embree", f.mega_over_embree, "x");
  add("time with ROBUST over without", f.robust_price, "x");
  add("exact film sums instead of floats", 100 * f.film_price, "% of time");
  add("shading at one lane over full width", f.shading_gain, "x");
  add("scheduler's share of worker time", 100 * f.scheduler_share, "%", "<= 1",
      f.scheduler_share <= 0.01);
  add("bubbles", 100 * f.idle_share, "%");
  add("path state and queues", f.mebibytes, "MiB", "<= 64", f.mebibytes <= 64);
  add("load", f.load_seconds, "s");
  add("BVH", f.bvh_seconds, "s");
  for (const auto& [threads, speed] : f.scaling) {
    if (threads == 1) continue;
    const bool two = threads == 2;
    add((std::to_string(threads) + " threads over one").c_str(), speed, "x", two ? ">= 1.9" : "",
        !two || speed >= 1.9);
  }
  return rows;
}

std::vector<Row> SummaryRows(const std::vector<SceneFigures>& scenes) {
  if (scenes.size() < 2) return {};
  const auto mean = [&](auto figure) {
    double sum = 0;
    for (const SceneFigures& f : scenes) sum += std::log(figure(f));
    return std::exp(sum / static_cast<double>(scenes.size()));
  };
  const double over_mega = mean([](const SceneFigures& f) { return f.over_mega; });
  const double of_singles = mean([](const SceneFigures& f) { return f.over_singles; });
  const double of_embree = mean([](const SceneFigures& f) { return f.over_embree; });
  const double mega_of_embree = mean([](const SceneFigures& f) { return f.mega_over_embree; });
  const std::string all = "geometric mean of " + std::to_string(scenes.size()) + " scenes: ";
  return {{all + "wavefront over megakernel", over_mega, "x", ">= 1.6", over_mega >= 1.6},
          {all + "wavefront over bare Embree's single rays", of_singles, "x", ">= 0.7",
           of_singles >= 0.7},
          {all + "wavefront over bare Embree", of_embree, "x", ">= 0.7", of_embree >= 0.7},
          {all + "megakernel over bare Embree", mega_of_embree, "x", "", true}};
}

}  // namespace carpool::tools
