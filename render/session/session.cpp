// The life of a render: passes that grow until samples, time or noise say stop, previews between,
// files at the end.
#include "render/session/session.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <sstream>

#include "render/film/resolve.h"
#include "render/posix/atomic_file.h"
#include "render/posix/trap_guard.h"
#include "render/session/near_walls.h"
#include "render/session/output.h"
#include "render/session/workspace.h"

namespace carpool::render {
namespace {

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// Drives one executor through the passes of one render.
class PassLoop {
 public:
  PassLoop(Workspace& workspace, const RenderSettings& settings, const std::atomic<bool>& stop,
           const ProgressSink& progress, Clock::time_point begin, RenderSummary& summary)
      : w_(workspace),
        settings_(settings),
        user_stop_(stop),
        progress_(progress),
        begin_(begin),
        summary_(summary) {}

  void Run() {
    if (!settings_.preview_path.empty()) FirstPreview();
    while (!Finished()) {
      Pass({.first_sample = done_, .sample_count = NextCount()});
      if (!settings_.preview_path.empty() && SecondsSince(preview_time_) >= kPreviewSeconds)
        SavePreview(false);
    }
    if (!settings_.preview_path.empty()) SavePreview(false);
    if (noise_ < 0) noise_ = EstimateNoise(w_.film());
    summary_.samples = static_cast<int>(done_);
    summary_.noise = noise_;
    summary_.render_seconds = SecondsSince(render_begin_);
    const bool missed = settings_.noise_target > 0 && !NoiseReached();
    if (missed) summary_.code = ExitCode::no;
    if (user_stop_) summary_.code = ExitCode::interrupted;
  }

 private:
  static constexpr double kPassSeconds = 2;  // a pass's end costs a fraction of a batch per worker
  static constexpr double kPreviewSeconds = 5;  // between refreshed previews

  bool NoiseReached() const { return noise_ >= 0 && noise_ <= settings_.noise_target; }
  bool TimeIsUp() const {
    return settings_.time_seconds > 0 && SecondsSince(render_begin_) >= settings_.time_seconds;
  }
  bool Finished() const {
    return stopped_ || user_stop_ || done_ >= static_cast<uint32_t>(settings_.samples) ||
           TimeIsUp() || (settings_.noise_target > 0 && NoiseReached());
  }

  /// Samples of the next pass: one to start with, then as many as fill kPassSeconds, in whole
  /// rounds of the scrambles.
  uint32_t NextCount() const {
    const uint32_t left = static_cast<uint32_t>(settings_.samples) - done_;
    if (seconds_per_sample_ <= 0) return 1;
    double seconds = kPassSeconds;
    if (settings_.time_seconds > 0) {
      seconds = std::min(seconds, settings_.time_seconds - SecondsSince(render_begin_));
    }
    const double fitting = std::clamp(seconds / seconds_per_sample_, 1.0, 4096.0);
    const uint32_t end = done_ + static_cast<uint32_t>(fitting);
    const uint32_t rounded = end / stages::kScrambles * stages::kScrambles;
    return std::clamp<uint32_t>(rounded > done_ ? rounded - done_ : 1, 1, left);
  }

  /// The first sample of an even subset of the groups of pixels, then of more, then of all.
  void FirstPreview() {
    const Clock::time_point start = Clock::now();
    Pass({.first_sample = 0, .sample_count = 1, .phases = 0x1}, false);
    SavePreview(true);
    summary_.first_preview_seconds = SecondsSince(start);
    if (stopped_) return;
    Pass({.first_sample = 0, .sample_count = 1, .phases = 0xfe}, false);
    SavePreview(true);
    if (!stopped_)
      Pass({.first_sample = 0, .sample_count = 1, .phases = stages::kAllPhases & ~0xffu});
  }

  void SavePreview(bool partial) {
    WritePicture(settings_.preview_path, w_.film(), settings_.exposure, partial);
    preview_time_ = Clock::now();
  }

  void Pass(const stages::CameraPass& pass, bool completes_samples = true) {
    const double before = SecondsSince(render_begin_);
    Clock::time_point last_update = {};
    const auto on_progress = [&](double fraction) {
      if (user_stop_ || TimeIsUp()) pass_stop_ = true;
      if (!progress_ || SecondsSince(last_update) < 0.1) return;
      last_update = Clock::now();
      Report(fraction * pass.sample_count, before);
    };
    const stages::PassReport report = w_.executor().Render(pass, pass_stop_, on_progress);
    stopped_ = report.stopped;
    summary_.rays += report.rays;
    summary_.schedule = report.schedule;
    summary_.comparison += report.comparison;
    summary_.state_bytes = std::max(summary_.state_bytes, report.state_bytes);
    summary_.queue_bytes = std::max<uint64_t>(summary_.queue_bytes, report.schedule.peak_bytes);
    if (stopped_ || !completes_samples) return;
    done_ = pass.first_sample + pass.sample_count;
    seconds_per_sample_ = (SecondsSince(render_begin_) - before) / pass.sample_count;
    if (settings_.noise_target > 0 || progress_) noise_ = EstimateNoise(w_.film());
    if (progress_) Report(0, SecondsSince(render_begin_));
  }

  void Report(double samples_in_pass, double pass_begin) {
    ProgressUpdate update;
    update.phase = ProgressPhase::render;
    const double samples = done_ + samples_in_pass;
    update.fraction = samples / settings_.samples;
    const double elapsed = SecondsSince(render_begin_);
    if (settings_.time_seconds > 0)
      update.fraction = std::max(update.fraction, elapsed / settings_.time_seconds);
    update.fraction = std::min(update.fraction, 1.0);
    update.samples_done = static_cast<int>(samples);
    update.samples_total = settings_.samples;
    update.elapsed_s = SecondsSince(begin_);
    update.noise = noise_;
    if (pass_begin > 0)
      update.rays_per_second = static_cast<double>(summary_.rays.total()) / pass_begin;
    progress_(update);
  }

  Workspace& w_;
  const RenderSettings& settings_;
  const std::atomic<bool>& user_stop_;
  const ProgressSink& progress_;
  Clock::time_point begin_;
  RenderSummary& summary_;

  Clock::time_point render_begin_ = Clock::now(), preview_time_ = Clock::now();
  std::atomic<bool> pass_stop_{false};
  bool stopped_ = false;  // a pass ended early: no further pass may follow it
  uint32_t done_ = 0;     // samples that every pixel has
  double seconds_per_sample_ = 0;
  double noise_ = -1;
};

void CheckOutputs(const RenderSettings& settings) {
  CheckWritable(settings.output_path);
  if (settings.write_png) CheckWritable(PngPath(settings.output_path));
  for (const std::string& path :
       {settings.preview_path, settings.stats_path, settings.trace_path}) {
    if (!path.empty()) CheckWritable(path);
  }
}

void Describe(const Workspace& w, const RenderSettings& settings, RenderSummary& summary) {
  summary.scene = settings.scene_path;
  summary.camera = w.scene().camera_name;
  summary.view = w.scene().tables.camera;
  summary.eye = w.scene().tables.origin;
  summary.environment = w.scene().environment_name;
  summary.executor_reason = w.plan().executor_reason;
  summary.isa = settings.executor == Executor::reference ? "double" : w.kernels().isa;
  summary.width = w.scene().width;
  summary.height = w.scene().height;
  summary.seed = settings.seed;
  summary.bvh_seconds = w.bvh().seconds();
  summary.bvh_bytes = w.bvh().bytes();
  summary.film_bytes = w.film().bytes();
}

void Save(const Workspace& w, const RenderSettings& settings, RenderSummary& summary) {
  const Clock::time_point begin = Clock::now();
  summary.ledger = w.film().Ledger();
  summary.clamp = settings.clamp;
  summary.output = settings.output_path;
  WriteImage(settings.output_path, w.film(), w.plan(), summary);
  if (settings.write_png)
    WritePicture(PngPath(settings.output_path), w.film(), settings.exposure, false);
  summary.save_seconds = SecondsSince(begin);
  if (!settings.stats_path.empty()) WriteText(settings.stats_path, summary.Json());
  if (!settings.trace_path.empty()) {
    std::ostringstream text;
    w.trace().write(text);
    WriteText(settings.trace_path, text.str());
  }
}

}  // namespace

RenderSummary Render(const RenderSettings& settings, const std::atomic<bool>& stop,
                     const ProgressSink& progress, const WarningSink& warn) {
  const Clock::time_point begin = Clock::now();
  CheckSettings(settings);
  CheckOutputs(settings);
  const auto phase = [&](ProgressPhase p) {
    if (progress) progress({.phase = p, .elapsed_s = SecondsSince(begin)});
  };
  Threads threads(settings.threads);
  RenderSummary summary;
  threads.arena().execute([&] {
    phase(ProgressPhase::load);
    PreparedScene scene = LoadScene(settings, warn);
    summary.load_seconds = SecondsSince(begin);
    phase(ProgressPhase::bvh);
    Workspace workspace(std::move(scene), settings, threads);
    WarnOfWallsNearLights(workspace.scene(), workspace.bvh().View(), warn);
    Describe(workspace, settings, summary);
    std::optional<TrapGuard> traps;
    if (settings.executor == Executor::reference)
      traps.emplace(static_cast<uint32_t>(workspace.scene().width));
    PassLoop(workspace, settings, stop, progress, begin, summary).Run();
    summary.executor = workspace.executor().name();
    if (const std::string why = workspace.executor().Why(); !why.empty())
      summary.executor_reason = why;
    phase(ProgressPhase::save);
    Save(workspace, settings, summary);
  });
  return summary;
}

}  // namespace carpool::render
