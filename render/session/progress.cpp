// Words and bar of the progress display, and when it is shown.
#include "render/session/progress.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>

namespace carpool::render {
namespace {

constexpr double kBarInterval = 0.1, kLineInterval = 5;  // seconds

const char* Word(ProgressPhase phase) {
  switch (phase) {
    case ProgressPhase::load:
      return "load";
    case ProgressPhase::bvh:
      return "BVH";
    case ProgressPhase::render:
      return "render";
    case ProgressPhase::save:
      return "save";
  }
  return "";
}

[[gnu::format(printf, 1, 2)]] std::string Print(const char* format, ...) {
  char text[96];
  va_list arguments;
  va_start(arguments, format);
  const int length = std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return std::string(text, std::clamp(length, 0, int{sizeof text} - 1));
}

// "4.2 s", "3:05", "2:07:00"
std::string Duration(double seconds) {
  if (seconds < 60) return Print("%.1f s", seconds);
  const auto whole = static_cast<long long>(seconds);
  if (whole < 3600) return Print("%lld:%02lld", whole / 60, whole % 60);
  return Print("%lld:%02lld:%02lld", whole / 3600, whole / 60 % 60, whole % 60);
}

// What the time spent in this phase says about the rest of it; negative while that is a guess.
double SecondsLeft(const ProgressUpdate& u, double phase_start_s) {
  if (u.fraction < 0.005 || u.fraction >= 1) return -1;
  return (u.elapsed_s - phase_start_s) * (1 - u.fraction) / u.fraction;
}

std::string Numbers(const ProgressUpdate& u, double phase_start_s) {
  std::string text;
  if (u.fraction >= 0) text += Print(" %3.0f %%", 100 * std::min(u.fraction, 1.0));
  if (u.samples_done >= 0 && u.samples_total > 0) {
    text += Print("  samples %d/%d", u.samples_done, u.samples_total);
  }
  text += "  " + Duration(u.elapsed_s);
  const double left = SecondsLeft(u, phase_start_s);
  if (left >= 0) text += "  ETA " + Duration(left);
  if (u.noise >= 0) text += Print("  noise %.2f %%", 100 * u.noise);
  if (u.rays_per_second >= 0) text += Print("  %.2f M rays/s", 1e-6 * u.rays_per_second);
  return text;
}

// The bar takes what the numbers leave of the line; without room or a known fraction there is none.
std::string BarLine(const ProgressUpdate& u, double phase_start_s, int columns) {
  const std::string word = Print("%-6s", Word(u.phase)), numbers = Numbers(u, phase_start_s);
  const int room = columns - 1 - static_cast<int>(word.size() + numbers.size()) - 3;
  std::string line = word;
  if (room >= 8 && u.fraction >= 0) {
    const int cells = std::min(room, 40);
    const int full = static_cast<int>(std::min(u.fraction, 1.0) * cells);
    line += " [" + std::string(full, '#') + std::string(cells - full, '.') + "]";
  }
  return (line + numbers).substr(0, std::max(columns - 1, 1));
}

}  // namespace

void ProgressPrinter::operator()(const ProgressUpdate& update) {
  if (style_ == ProgressStyle::silent) return;
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  const bool due = IsDue(update);
  const bool phase_ended = any_ && update.phase != last_.phase;
  if (phase_ended && pending_ && style_ == ProgressStyle::lines) Show();  // how it ended
  if (!any_ || update.phase != last_.phase) phase_start_s_ = any_ ? update.elapsed_s : 0;
  last_ = update;
  any_ = pending_ = true;
  if (due) Show();
}

void ProgressPrinter::Message(const std::string& line) {
  if (style_ == ProgressStyle::silent) return;
  const std::lock_guard lock(mutex_);
  EraseBar();
  std::fprintf(out_, "%s\n", line.c_str());
  if (style_ == ProgressStyle::bar && any_ && !finished_) Show();
  std::fflush(out_);
}

void ProgressPrinter::Finish() {
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  finished_ = true;
  if (pending_) Show();
  if (bar_on_screen_) std::fputc('\n', out_);
  bar_on_screen_ = false;
  std::fflush(out_);
}

bool ProgressPrinter::IsDue(const ProgressUpdate& update) const {
  if (!any_ || update.phase != last_.phase) return true;
  const double interval = style_ == ProgressStyle::bar ? kBarInterval : kLineInterval;
  return update.elapsed_s >= shown_s_ + interval;
}

void ProgressPrinter::Show() {
  EraseBar();
  if (style_ == ProgressStyle::bar) {
    std::fputs(BarLine(last_, phase_start_s_, columns_).c_str(), out_);
    bar_on_screen_ = true;
  } else {
    std::fprintf(out_, "%s%s\n", Word(last_.phase), Numbers(last_, phase_start_s_).c_str());
  }
  std::fflush(out_);
  shown_s_ = last_.elapsed_s;
  pending_ = false;
}

void ProgressPrinter::EraseBar() {
  if (!bar_on_screen_) return;
  std::fputs("\r\033[K", out_);
  bar_on_screen_ = false;
}

}  // namespace carpool::render
