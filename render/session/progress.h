// Tells a person how far a render is: a bar on a terminal, now and then a line elsewhere.
#pragma once

#include <cstdio>
#include <functional>
#include <mutex>
#include <string>

namespace carpool::render {

enum class ProgressPhase { load, bvh, render, save };

/// How far a render is. Negative numbers mean "unknown" and are left out of what is shown.
struct ProgressUpdate {
  ProgressPhase phase = ProgressPhase::load;
  double fraction = -1;         ///< of this phase, 0..1
  int samples_done = -1;        ///< samples per pixel that the whole image has
  int samples_total = -1;       ///< samples per pixel asked for
  double elapsed_s = 0;         ///< seconds since Render() began; never decreases
  double noise = -1;            ///< relative standard error of the image
  double rays_per_second = -1;  ///< rays of all kinds, over the render phase so far
};

/// Receives updates; must be callable from any thread.
using ProgressSink = std::function<void(const ProgressUpdate&)>;

enum class ProgressStyle { silent, lines, bar };

/// Shows updates on a stream. Thread-safe; updates that come too fast are dropped by their own
/// `elapsed_s` (a bar is redrawn at most ten times a second, lines come every five seconds), but
/// the first of a phase and, by Finish(), the last of all are shown.
///
///   ProgressPrinter progress(ProgressStyle::bar, 80);
///   Render(settings, stop, std::ref(progress));
///   progress.Finish();
class ProgressPrinter {
 public:
  /// `columns` is the terminal's width, for the bar; `out` must outlive the printer.
  explicit ProgressPrinter(ProgressStyle style, int columns = 80, std::FILE* out = stderr)
      : style_(style), columns_(columns), out_(out) {}
  ~ProgressPrinter() { Finish(); }
  ProgressPrinter(const ProgressPrinter&) = delete;
  ProgressPrinter& operator=(const ProgressPrinter&) = delete;

  void operator()(const ProgressUpdate& update);

  /// Message prints a line of its own, e.g. a warning, without tearing the bar; not if silent.
  void Message(const std::string& line);

  /// Finish shows the last update if it was dropped and leaves the cursor on a fresh line.
  /// Updates after it are ignored.
  void Finish();

 private:
  bool IsDue(const ProgressUpdate& update) const;
  void Show();
  void EraseBar();

  const ProgressStyle style_;
  const int columns_;
  std::FILE* const out_;

  std::mutex mutex_;          // guards all below
  ProgressUpdate last_;       // the latest update, shown or not
  double phase_start_s_ = 0;  // elapsed_s when its phase began
  double shown_s_ = 0;        // elapsed_s of what was last shown
  bool any_ = false;          // has there been an update?
  bool pending_ = false;      // is `last_` yet to be shown?
  bool bar_on_screen_ = false;
  bool finished_ = false;
};

}  // namespace carpool::render
