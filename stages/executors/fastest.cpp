// The automatic executor: tries the candidates on small parts of the image and goes on with the
// fastest.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "stages/executors/executor.h"

namespace carpool::stages {
namespace {

// Fewer paths than this would measure the clock. More are for who follows many at once: candidates
// may be several times slower than the best, and what they are tried with is lost.
constexpr uint64_t kLeastPaths = 16384;
constexpr int kRounds = 3;           // each candidate's parts at most; their median counts
constexpr double kClearLead = 1.25;  // one round is enough where it shows this much

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

/// A pass in parts, each an even subset of the pixels, and the sum of what was reported.
class Parts {
 public:
  Parts(const CameraPass& pass, const std::atomic<bool>& stop,
        const std::function<void(double)>& progress)
      : pass_(pass), left_(pass.phases), stop_(stop), progress_(progress) {}

  int Left() const { return std::popcount(left_); }
  bool Stopped() const { return sum_.stopped; }
  const PassReport& Sum() const { return sum_; }

  /// Has `executor` render `count` more phases; returns its seconds per sample of one phase.
  double Render(Executor& executor, int count) {
    CameraPass part = pass_;
    part.phases = 0;
    for (int i = 0; i < count; ++i) part.phases |= std::bit_floor(left_ & ~part.phases);
    const double all = std::popcount(pass_.phases);
    const double before = all - Left();
    std::function<void(double)> progress;
    if (progress_) progress = [&](double f) { progress_((before + f * count) / all); };
    const PassReport report = executor.Render(part, stop_, progress);
    left_ &= ~part.phases;
    Add(report);
    return report.seconds / (static_cast<double>(count) * pass_.sample_count);
  }

 private:
  void Add(const PassReport& part) {
    const PassReport before = sum_;
    sum_ = part;
    sum_.rays += before.rays;
    sum_.seconds += before.seconds;
    sum_.idle_seconds += before.idle_seconds;
    sum_.state_bytes = std::max(part.state_bytes, before.state_bytes);
  }

  CameraPass pass_;
  uint32_t left_;
  const std::atomic<bool>& stop_;
  const std::function<void(double)>& progress_;
  PassReport sum_;
};

class Fastest final : public Executor {
 public:
  Fastest(std::vector<std::unique_ptr<Executor>> candidates, uint64_t pixels)
      : candidates_(std::move(candidates)), pixels_(pixels), costs_(candidates_.size()) {}

  std::string_view name() const override { return candidates_[chosen_]->name(); }
  std::string Dot() const override { return candidates_[chosen_]->Dot(); }
  std::string Why() const override { return why_; }

  PassReport Render(const CameraPass& pass, const std::atomic<bool>& stop,
                    const std::function<void(double)>& progress) override {
    Parts parts(pass, stop, progress);
    const double paths = static_cast<double>(pixels_ * pass.sample_count) / kPhases;
    while (!decided_ && !parts.Stopped()) {
      const uint64_t wanted = std::max(kLeastPaths, candidates_[turn_]->PathsInFlight());
      const int part = static_cast<int>(std::ceil(static_cast<double>(wanted) / paths));
      if (part > parts.Left()) break;
      Try(parts, part);
    }
    if (!parts.Stopped() && parts.Left() > 0) parts.Render(*candidates_[chosen_], parts.Left());
    return parts.Sum();
  }

 private:
  /// One more part, by whoever's turn it is. The first warms up pages and caches and does not
  /// count.
  void Try(Parts& parts, int phases) {
    const size_t turn = turn_;
    const double cost = parts.Render(*candidates_[turn], phases);
    if (parts.Stopped() || !std::exchange(warm_, true)) return;
    costs_[turn].push_back(cost);
    turn_ = (turn + 1) % candidates_.size();
    if (turn_ != 0) return;
    const bool enough = costs_[0].size() == kRounds;
    decided_ = Decide() >= kClearLead || enough;
  }

  /// Chooses by what is known so far; returns how much longer the second best takes.
  double Decide() {
    std::vector<double> medians;
    for (const std::vector<double>& costs : costs_) medians.push_back(Median(costs));
    const auto best = std::min_element(medians.begin(), medians.end());
    chosen_ = static_cast<size_t>(best - medians.begin());
    double lead = std::numeric_limits<double>::infinity();
    why_ = "measured here";
    for (size_t i = 0; i < medians.size(); ++i) {
      if (i == chosen_) continue;
      const double ratio = medians[i] / std::max(*best, 1e-9);
      lead = std::min(lead, ratio);
      char text[16];
      std::snprintf(text, sizeof text, ", %.2fx ", ratio);
      why_ += text + std::string(candidates_[i]->name());
    }
    return lead;
  }

  std::vector<std::unique_ptr<Executor>> candidates_;
  uint64_t pixels_;
  std::vector<std::vector<double>>
      costs_;  // of each candidate's parts, seconds per sample of a phase
  size_t turn_ = 0, chosen_ = 0;
  bool warm_ = false, decided_ = false;
  std::string why_ = "too few samples to measure";
};

}  // namespace

std::unique_ptr<Executor> MakeFastest(std::vector<std::unique_ptr<Executor>> candidates,
                                      uint64_t pixels) {
  return std::make_unique<Fastest>(std::move(candidates), pixels);
}

}  // namespace carpool::stages
