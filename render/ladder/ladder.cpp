// Runs the rungs of the ladder in turn over one scene and compares their images.
#include "render/ladder/ladder.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "render/film/resolve.h"
#include "render/session/workspace.h"
#include "stages/executors/ladder.h"

namespace carpool::render {
namespace {

using stages::Executor;
using stages::ExecutorOptions;
using stages::Grain;
using stages::KernelContext;

/// How one rung is made. Each changes one thing about the one before.
struct Rung {
  const char* name;
  bool serial = false;
  bool direct_light = true;
  std::function<std::unique_ptr<Executor>(const KernelContext&, const Workspace&, ExecutorOptions)>
      make;
};

auto MakeRecursive(Grain grain) {
  return [grain](const KernelContext& c, const Workspace& w, const ExecutorOptions& o) {
    return stages::MakeRecursive(c, w.kernels(), o, grain);
  };
}

auto MakeGraph(bool refined) {
  return [refined](const KernelContext& c, const Workspace& w, ExecutorOptions o) {
    o.bins = o.simd = refined;
    return stages::MakeWavefront(c, w.kernels(), w.scene().tables.geometry.placements, o);
  };
}

const std::vector<Rung>& Rungs() {
  static const std::vector<Rung> rungs = {
      {"serial recursion, pure path tracing", true, false, MakeRecursive(Grain::serial)},
      {"direct illumination", true, true, MakeRecursive(Grain::serial)},
      {"parallel over pixels", false, true, MakeRecursive(Grain::pixel)},
      {"parallel over paths", false, true, MakeRecursive(Grain::path)},
      {"iteration instead of recursion", false, true,
       [](const KernelContext& c, const Workspace& w, const ExecutorOptions& o) {
         return stages::MakeMegakernel(c, w.kernels(), o);
       }},
      {"wavefront arrays with barriers", false, true,
       [](const KernelContext& c, const Workspace& w, const ExecutorOptions& o) {
         return stages::MakeBarriers(c, w.kernels(), o);
       }},
      {"stage graph, one queue per stage", false, true, MakeGraph(false)},
      {"bins by material and depth, SIMD", false, true, MakeGraph(true)}};
  return rungs;
}
constexpr size_t kBaseline = 2;  // rung 3

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

struct Image {
  RgbPlane mean, error;
};

double Luminance(const RgbPlane& plane, size_t pixel) {
  return 0.2126 * plane[3 * pixel] + 0.7152 * plane[3 * pixel + 1] + 0.0722 * plane[3 * pixel + 2];
}

struct Comparison {
  double relative = 0, p_value = 1;
};

/// Two-sided; the images' means are sums over so many pixels that they are normal. Where both come
/// from the same random numbers they differ less than the test expects.
Comparison Compare(const Image& a, const Image& b) {
  double sum = 0, difference = 0, variance = 0;
  for (size_t pixel = 0; pixel < a.mean.size() / 3; ++pixel) {
    sum += Luminance(b.mean, pixel);
    difference += Luminance(a.mean, pixel) - Luminance(b.mean, pixel);
    variance += std::pow(Luminance(a.error, pixel), 2) + std::pow(Luminance(b.error, pixel), 2);
  }
  Comparison c;
  c.relative = sum > 0 ? difference / sum : 0;
  if (variance > 0) c.p_value = std::erfc(std::abs(difference) / std::sqrt(2 * variance));
  if (variance <= 0 && difference != 0) c.p_value = 0;
  return c;
}

/// One rung at work: its figures so far, and its last image.
struct Track {
  std::vector<double> seconds, mega_rays;
  stages::PassReport last;
  std::optional<Image> image;
};

class Ladder {
 public:
  Ladder(const RenderSettings& settings, const LadderOptions& options,
         const std::atomic<bool>& stop, const std::function<void(const std::string&)>& progress,
         Workspace& workspace, Threads& threads)
      : settings_(settings),
        options_(options),
        stop_(stop),
        progress_(progress),
        w_(workspace),
        tracks_(Rungs().size()) {
    executor_options_ = ExecutorOptionsFor(settings, threads);
  }

  LadderReport Run();

 private:
  /// Renders by one rung; nothing if it was stopped.
  std::optional<stages::PassReport> Render(size_t rung, const stages::CameraPass& pass,
                                           Image* image) const;
  std::string WhySkipped(size_t rung) const;
  RungResult Result(size_t rung, double baseline) const;

  const RenderSettings& settings_;
  const LadderOptions& options_;
  const std::atomic<bool>& stop_;
  const std::function<void(const std::string&)>& progress_;
  Workspace& w_;
  ExecutorOptions executor_options_;
  std::vector<Track> tracks_;
};

std::optional<stages::PassReport> Ladder::Render(size_t rung, const stages::CameraPass& pass,
                                                 Image* image) const {
  stages::FilmAccumulator film(w_.context().width, w_.context().height, w_.film().planes());
  KernelContext context = w_.context();
  context.film = &film;
  if (!Rungs()[rung].direct_light) context.direct = stages::DirectSampling::bsdf;
  const std::unique_ptr<Executor> executor = Rungs()[rung].make(context, w_, executor_options_);
  stages::PassReport report = executor->Render(pass, stop_, {});
  if (report.stopped) return {};
  if (image != nullptr) *image = {ResolveBeauty(film), ResolveStandardError(film)};
  return report;
}

/// A serial rung is tried on 1/32 of the pixels first.
std::string Ladder::WhySkipped(size_t rung) const {
  if (!Rungs()[rung].serial) return {};
  const auto trial = Render(rung, {.sample_count = 1, .phases = 1}, nullptr);
  if (!trial) return {};
  const double expected = trial->seconds * stages::kPhases * settings_.samples * options_.rounds;
  if (expected <= options_.serial_seconds) return {};
  char note[120];
  std::snprintf(note, sizeof note, "skipped: about %.0f s, more than --serial-seconds %.0f",
                expected, options_.serial_seconds);
  return note;
}

RungResult Ladder::Result(size_t rung, double baseline) const {
  const Track& track = tracks_[rung];
  const stages::PassReport& last = track.last;
  RungResult r;
  r.ran = !track.seconds.empty();
  if (!r.ran) return r;
  r.seconds = Median(track.seconds);
  r.mega_rays = Median(track.mega_rays);
  r.speed = baseline / r.seconds;
  r.seats_filled = last.seats_filled;
  r.run_length = last.run_length;
  const double threads = Rungs()[rung].serial ? 1 : executor_options_.threads;
  r.bubbles = last.idle_seconds / (threads * last.seconds);
  r.state_mebibytes = static_cast<double>(last.state_bytes + last.schedule.peak_bytes) / (1 << 20);
  const RunReport& s = last.schedule;
  const double all = s.kernel_seconds + s.source_seconds + s.scheduler_seconds + s.idle_seconds;
  if (all > 0) r.scheduler = s.scheduler_seconds / all;
  const std::optional<Image>& reference = tracks_.back().image;
  if (reference) {
    r.identical = track.image->mean == reference->mean;
    if (!r.identical) {
      const Comparison c = Compare(*track.image, *reference);
      r.difference = c.relative;
      r.p_value = c.p_value;
    }
  }
  return r;
}

LadderReport Ladder::Run() {
  LadderReport report;
  const size_t count = Rungs().size();
  std::vector<std::string> notes(count);
  for (size_t rung = 0; rung < count; ++rung) notes[rung] = WhySkipped(rung);
  for (int round = 0; round < options_.rounds && !stop_; ++round) {
    for (size_t rung = 0; rung < count && !stop_; ++rung) {
      if (!notes[rung].empty()) continue;
      if (progress_) {
        progress_("round " + std::to_string(round + 1) + " of " + std::to_string(options_.rounds) +
                  ", rung " + std::to_string(rung + 1) + ": " + Rungs()[rung].name);
      }
      Image image;
      const stages::CameraPass pass{.sample_count = static_cast<uint32_t>(settings_.samples)};
      const auto done = Render(rung, pass, &image);
      if (!done) break;
      Track& track = tracks_[rung];
      track.seconds.push_back(done->seconds);
      track.mega_rays.push_back(static_cast<double>(done->rays.total()) / done->seconds / 1e6);
      track.last = *done;
      track.image = std::move(image);
    }
  }
  report.stopped = stop_;
  report.isa = w_.kernels().isa;
  report.width = w_.scene().width;
  report.height = w_.scene().height;
  report.threads = static_cast<int>(executor_options_.threads);
  const double baseline = Median(tracks_[kBaseline].seconds);
  for (size_t rung = 0; rung < count; ++rung) {
    RungResult result = Result(rung, baseline);
    result.number = static_cast<int>(rung) + 1;
    result.name = Rungs()[rung].name;
    result.note = notes[rung];
    report.rungs.push_back(result);
  }
  return report;
}

}  // namespace

LadderReport RunLadder(const RenderSettings& settings, const LadderOptions& options,
                       const std::atomic<bool>& stop,
                       const std::function<void(const std::string&)>& progress,
                       const WarningSink& warn) {
  CheckSettings(settings);
  Threads threads(settings.threads);
  LadderReport report;
  threads.arena().execute([&] {
    if (progress) progress("loading");
    Workspace workspace(LoadScene(settings, warn), settings, threads);
    report = Ladder(settings, options, stop, progress, workspace, threads).Run();
  });
  report.scene = settings.scene_path;
  report.samples = settings.samples;
  report.rounds = options.rounds;
  return report;
}

}  // namespace carpool::render
