// Every rung renders the same image, and the report's figures are what they say.
#include "render/ladder/ladder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/support/scene_builder.h"

namespace carpool::render {
namespace {

using carpool::test::SceneBuilder;

/// A lit room with a veil to pass through, seen by a camera.
std::filesystem::path Room(const std::filesystem::path& folder) {
  SceneBuilder b;
  const int wall = b.AddLambert({0.7, 0.6, 0.5});
  const int lamp = b.AddLambert({0, 0, 0}, {1, 0.9, 0.8}, 8);
  const int veil = b.AddMaterial(
      {{"pbrMetallicRoughness", {{"baseColorFactor", {0.2, 0.5, 0.9, 0.4}}, {"metallicFactor", 0}}},
       {"alphaMode", "BLEND"},
       {"doubleSided", true}});
  b.PlaceMesh(b.AddBox(2, wall, true));
  b.PlaceMesh(b.AddQuad({-1, 1.9, -1}, {1, 1.9, -1}, {1, 1.9, 1}, {-1, 1.9, 1}, lamp));
  b.PlaceMesh(b.AddQuad({-1, -1, 0.5}, {1, -1, 0.5}, {1, 1, 0.5}, {-1, 1, 0.5}, veil));
  b.PlaceMesh(b.AddSphere(0.5, 12, wall, false));
  b.AddCamera({0, 0, 1.9}, 1);
  return b.Write(folder, "room");
}

class LadderTest : public testing::Test {
 protected:
  RenderSettings Settings() const {
    RenderSettings s;
    s.scene_path = Room(folder_.path()).string();
    s.width = 61;
    s.height = 35;
    s.samples = 16;
    s.threads = 2;
    return s;
  }
  LadderReport Run(const RenderSettings& settings, const LadderOptions& options) {
    return RunLadder(settings, options, stop_, {}, {});
  }
  carpool::test::ScratchFolder folder_;
  std::atomic<bool> stop_{false};
};

TEST_F(LadderTest, AllRungsWithLightSamplingGiveTheSameBytes) {
  for (const int threads : {1, 8}) {
    for (const int batch : {0, 8}) {
      RenderSettings settings = Settings();
      settings.threads = threads;
      settings.batch_items = batch;
      settings.memory_mb = batch == 8 ? 1 : 0;
      const LadderReport report = Run(settings, {.rounds = 1});
      ASSERT_EQ(report.rungs.size(), 8u);
      for (size_t rung = 1; rung < report.rungs.size(); ++rung) {
        EXPECT_TRUE(report.rungs[rung].identical) << report.rungs[rung].name;
      }
    }
  }
}

/// One test, one seed: fails by chance once in 10^6.
TEST_F(LadderTest, PurePathTracingHasTheSameExpectation) {
  const LadderReport report = Run(Settings(), {.rounds = 1});
  const RungResult& pure = report.rungs.front();
  EXPECT_FALSE(pure.identical);
  EXPECT_GT(pure.p_value, 1e-6);
  EXPECT_NE(pure.difference, 0);
}

TEST_F(LadderTest, FiguresAreWhatTheySay) {
  const LadderReport report = Run(Settings(), {.rounds = 2});
  EXPECT_EQ(report.threads, 2);
  EXPECT_EQ(report.width, 61);
  for (const RungResult& r : report.rungs) {
    ASSERT_TRUE(r.ran) << r.name;
    EXPECT_GT(r.seconds, 0);
    EXPECT_GT(r.mega_rays, 0);
    EXPECT_GE(r.run_length, 1);
    EXPECT_GT(r.seats_filled, 0);
    EXPECT_LE(r.seats_filled, 1);
    EXPECT_GE(r.bubbles, 0);
    EXPECT_LT(r.bubbles, 1);
    EXPECT_GT(r.state_mebibytes, 0);
    EXPECT_EQ(r.scheduler >= 0, r.number >= 7) << r.name;
  }
  EXPECT_EQ(report.rungs[2].speed, 1);
  EXPECT_EQ(report.rungs[4].run_length, 1);
  EXPECT_GT(report.rungs[5].run_length, 100);  // thousands of paths in chunks of 256
  EXPECT_GT(report.rungs[7].seats_filled, 2 * report.rungs[6].seats_filled);
}

TEST_F(LadderTest, SerialRungsThatTakeTooLongAreSkippedWithANote) {
  const LadderReport report = Run(Settings(), {.rounds = 1, .serial_seconds = 0});
  for (const RungResult& r : report.rungs) {
    EXPECT_EQ(r.ran, r.number > 2) << r.name;
    EXPECT_EQ(r.note.empty(), r.ran) << r.name;
  }
  EXPECT_NE(report.Text().find("skipped"), std::string::npos);
}

TEST_F(LadderTest, StopEndsItWithoutFigures) {
  stop_ = true;
  const LadderReport report = Run(Settings(), {});
  EXPECT_TRUE(report.stopped);
  EXPECT_TRUE(std::none_of(report.rungs.begin(), report.rungs.end(),
                           [](const RungResult& r) { return r.ran; }));
}

TEST_F(LadderTest, JsonAndPageHoldEveryRung) {
  const LadderReport report = Run(Settings(), {.rounds = 1});
  const auto json = nlohmann::json::parse(report.Json());
  ASSERT_EQ(json["rungs"].size(), 8u);
  EXPECT_EQ(json["rungs"][7]["identical"], true);
  EXPECT_EQ(json["rungs"][7]["seconds"], report.rungs[7].seconds);
  const std::string page = report.Html();
  for (const RungResult& r : report.rungs) EXPECT_NE(page.find(r.name), std::string::npos);
}

}  // namespace
}  // namespace carpool::render
