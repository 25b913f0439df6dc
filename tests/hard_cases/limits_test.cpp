// Published limits are said at render time: a wall so near a lamp that shadow rays miss it.
#include <gtest/gtest.h>

#include "tests/hard_cases/scenes.h"

namespace carpool::test {
namespace {

/// All warnings of one render.
std::string WarningsOf(const SceneCase& scene) {
  const ScratchFolder folder;
  render::RenderSettings settings = WriteCase(scene, folder.path());
  settings.output_path = (folder.path() / "image.exr").string();
  settings.samples = 1;
  std::string warnings;
  const std::atomic<bool> stop{false};
  render::Render(settings, stop, {}, [&](const std::string& line) { warnings += line + "\n"; });
  return warnings;
}

/// A floor of 20 m, `what` 4 m above its middle with a lid `gap` metres below it.
SceneCase Covered(const std::string& what, double gap) {
  SceneCase c{.name = "covered_" + what};
  SceneBuilder& b = c.scene;
  const int grey = b.AddLambert({0.5, 0.5, 0.5});
  const double lid = 4 - gap;
  b.PlaceMesh(b.AddQuad({-10, 0, 10}, {10, 0, 10}, {10, 0, -10}, {-10, 0, -10}, grey));
  b.PlaceMesh(b.AddQuad({-2, lid, 2}, {2, lid, 2}, {2, lid, -2}, {-2, lid, -2}, grey));
  if (what == "point") {
    b.AddPunctual({{"type", "point"}, {"intensity", 5}}, {{"translation", {0, 4, 0}}});
  } else {
    const int lamp = b.AddLambert({0, 0, 0}, {1, 1, 1}, 5);
    b.PlaceMesh(b.AddQuad({-1, 4, -1}, {1, 4, -1}, {1, 4, 1}, {-1, 4, 1}, lamp));
  }
  b.AddCamera({0, 1, 5}, 1);
  c.settings = HardSettings(1, 2);
  return c;
}

TEST(HardRow04, AWallVeryNearALampIsWarnedAbout) {
  for (const char* what : {"point", "quad"}) {
    const std::string warnings = WarningsOf(Covered(what, 2e-5));
    EXPECT_NE(warnings.find("closer in front of them than shadow rays can tell"), std::string::npos)
        << what << ": " << warnings;
    EXPECT_EQ(WarningsOf(Covered(what, 1e-2)), "") << what;
  }
}

TEST(HardRow04, OrdinaryRoomsAreNotWarnedAbout) {
  for (const double scale : {1e-6, 1.0, 1e6})
    EXPECT_EQ(WarningsOf(RoomAt(scale, {0, 0, 0})), "") << scale;
}

}  // namespace
}  // namespace carpool::test
