// The automatic executor: renders every phase of every pass once and goes on with whoever was
// fastest.
#include <gtest/gtest.h>

#include <bit>
#include <vector>

#include "stages/executors/executor.h"

namespace carpool::stages {
namespace {

constexpr uint64_t kPixels = uint64_t{1} << 20;

/// Renders nothing and says that it took so many seconds per phase.
class Fake final : public Executor {
 public:
  Fake(std::string_view name, double cost, uint64_t in_flight, std::vector<CameraPass>& log)
      : name_(name), cost_(cost), in_flight_(in_flight), log_(log) {}
  std::string_view name() const override { return name_; }
  std::string Dot() const override { return {}; }
  uint64_t PathsInFlight() const override { return in_flight_; }
  PassReport Render(const CameraPass& pass, const std::atomic<bool>& stop,
                    const std::function<void(double)>& progress) override {
    log_.push_back(pass);
    if (progress) progress(1);
    PassReport report;
    report.rays.camera = static_cast<uint64_t>(std::popcount(pass.phases));
    report.seconds = cost_ * std::popcount(pass.phases);
    report.stopped = stop.load();
    return report;
  }

 private:
  std::string_view name_;
  double cost_;
  uint64_t in_flight_;
  std::vector<CameraPass>& log_;
};

class FastestTest : public testing::Test {
 protected:
  std::unique_ptr<Executor> Make(double cost_a, double cost_b, uint64_t pixels = kPixels) {
    std::vector<std::unique_ptr<Executor>> candidates;
    candidates.push_back(std::make_unique<Fake>("a", cost_a, 65536, a_));
    candidates.push_back(std::make_unique<Fake>("b", cost_b, 0, b_));
    return MakeFastest(std::move(candidates), pixels);
  }
  std::vector<CameraPass> a_, b_;
  std::atomic<bool> stop_{false};
};

TEST_F(FastestTest, ChoosesTheFasterAndStaysWithIt) {
  for (const bool first : {true, false}) {
    a_.clear(), b_.clear();
    const auto executor = Make(first ? 1 : 2, first ? 2 : 1);
    executor->Render({.sample_count = 8}, stop_, {});
    EXPECT_EQ(executor->name(), first ? "a" : "b");
    EXPECT_EQ(executor->Why(), first ? "measured here, 2.00x b" : "measured here, 2.00x a");
    const size_t tries_of_a = a_.size(), tries_of_b = b_.size();
    executor->Render({.first_sample = 8, .sample_count = 8}, stop_, {});
    EXPECT_EQ(a_.size(), tries_of_a + (first ? 1 : 0));
    EXPECT_EQ(b_.size(), tries_of_b + (first ? 0 : 1));
  }
}

TEST_F(FastestTest, RendersEveryPhaseOfAPassOnce) {
  for (const double cost_b : {0.5, 1.0, 1.01, 3.0}) {
    for (const uint32_t phases : {kAllPhases, kAllPhases & ~0xffu}) {
      a_.clear(), b_.clear();
      const auto executor = Make(1, cost_b);
      const PassReport report =
          executor->Render({.first_sample = 3, .sample_count = 64, .phases = phases}, stop_, {});
      uint32_t seen = 0;
      for (const auto* log : {&a_, &b_}) {
        for (const CameraPass& part : *log) {
          EXPECT_EQ(seen & part.phases, 0u);
          EXPECT_EQ(part.first_sample, 3u);
          EXPECT_EQ(part.sample_count, 64u);
          seen |= part.phases;
        }
      }
      EXPECT_EQ(seen, phases);
      EXPECT_EQ(report.rays.camera, static_cast<uint64_t>(std::popcount(phases)));
    }
  }
}

TEST_F(FastestTest, MeasuresCloseOnesMoreOften) {
  Make(1, 1.05)->Render({.sample_count = 64}, stop_, {});
  EXPECT_EQ(b_.size(), 3u);
  b_.clear();
  Make(1, 2)->Render({.sample_count = 64}, stop_, {});
  EXPECT_EQ(b_.size(), 1u);
}

TEST_F(FastestTest, MeasuresOverSeveralPassesIfTheyAreShort) {
  const auto executor = Make(1, 1.05, 3 * 65536);  // 11 phases of a are a part, 3 of b
  for (uint32_t sample = 0; sample < 4; ++sample)
    executor->Render({.first_sample = sample, .sample_count = 1}, stop_, {});
  EXPECT_EQ(b_.size(), 3u);
  EXPECT_EQ(executor->Why(), "measured here, 1.05x b");
}

TEST_F(FastestTest, DoesNotMeasureWhatIsTooShort) {
  const auto executor = Make(2, 1, 1000);
  executor->Render({.sample_count = 64}, stop_, {});
  EXPECT_EQ(executor->name(), "a");
  EXPECT_EQ(executor->Why(), "too few samples to measure");
  EXPECT_TRUE(b_.empty());
  executor->Render({.first_sample = 64, .sample_count = 64, .phases = 0xff}, stop_, {});
  EXPECT_TRUE(b_.empty());
}

TEST_F(FastestTest, TriesWithLessWhoFollowsFewPathsAtOnce) {
  Make(1, 3)->Render({.sample_count = 1}, stop_, {});  // 2^15 paths a phase
  ASSERT_EQ(b_.size(), 1u);
  EXPECT_EQ(std::popcount(b_[0].phases), 1);
  ASSERT_EQ(a_.size(), 3u);  // the warm-up, the part that is timed, all that is left
  EXPECT_EQ(std::popcount(a_[0].phases), 2);
  EXPECT_EQ(std::popcount(a_[1].phases), 2);
}

TEST_F(FastestTest, StopsBetweenParts) {
  stop_ = true;
  const auto executor = Make(1, 2);
  EXPECT_TRUE(executor->Render({.sample_count = 64}, stop_, {}).stopped);
  EXPECT_EQ(a_.size() + b_.size(), 1u);
}

TEST_F(FastestTest, ProgressGrowsToOne) {
  double last = 0;
  Make(1, 1.01)->Render({.sample_count = 64}, stop_, [&](double fraction) {
    EXPECT_GT(fraction, last);
    last = fraction;
  });
  EXPECT_DOUBLE_EQ(last, 1);
}

}  // namespace
}  // namespace carpool::stages
