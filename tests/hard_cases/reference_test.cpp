// Row 48: every path in float beside the same path in double, over all scenes of the suite, with
// floating-point traps on.
#include <gtest/gtest.h>

#include <algorithm>
#include <cfenv>
#include <cmath>

#include "render/posix/trap_guard.h"
#include "render/session/comparison.h"
#include "stages/simd/float_traps.h"
#include "tests/hard_cases/checks.h"
#include "tests/hard_cases/scenes.h"
#include "tests/render/session/render_once.h"

namespace carpool::test {
namespace {

using stages::Parting;
using stages::PathComparison;

Rendered InDouble(const SceneCase& scene, int samples) {
  const ScratchFolder folder;
  render::RenderSettings settings = WriteCase(scene, folder.path());
  settings.executor = render::Executor::reference;
  settings.samples = samples;
  // Each bounce multiplies what rounding has moved: paths of a hundred vertices always part.
  settings.max_depth = std::min(settings.max_depth, 8);
  return RenderOnce(settings);
}

uint64_t Together(const PathComparison& c) {
  return c.parted[static_cast<size_t>(Parting::none)];
}

/// Share of the paths that decided something differently.
double PartedShare(const PathComparison& c) {
  return 1 - static_cast<double>(Together(c)) / static_cast<double>(c.paths);
}

/// Root mean square of how far samples of the other paths are off.
double RootMeanSquare(const PathComparison& c) {
  return std::sqrt(c.squares / static_cast<double>(std::max<uint64_t>(1, Together(c))));
}

double MeanDifference(const PathComparison& c) {
  return c.reference_sum > 0 ? c.sum / c.reference_sum - 1 : 0;
}

/// Sheets in one place, or seen from nearer than their coordinates are known: which of them a ray
/// meets first is a matter of rounding alone.
bool HitsAreRoundings(const SceneCase& scene) {
  return scene.name.rfind("row07_coincident", 0) == 0 || scene.name == "row29_corner_of_lights";
}

/// No statistics: both have the same random numbers.
TEST(HardRow48, FloatPathsKeepToTheirSelvesInDouble) {
  for (const SceneCase& scene : AllScenes()) {
    const Rendered rendered = InDouble(scene, 4);
    const PathComparison& c = rendered.summary.comparison;
    std::printf("row 48, %s: %.2g part, the others' root mean square is %.2g, the mean %.2g off\n",
                scene.name.c_str(), PartedShare(c), RootMeanSquare(c), MeanDifference(c));
    SCOPED_TRACE(RenderCommand(scene, 0) + " --executor reference\n" +
                 render::ComparisonText(rendered.summary));
    EXPECT_EQ(c.paths, 4u * 16 * 16);
    EXPECT_EQ(rendered.summary.isa, "double");
    EXPECT_EQ(rendered.summary.ledger.Count(), 0u);
    EXPECT_LE(PartedShare(c), HitsAreRoundings(scene) ? 1 : 0.05);
    EXPECT_LE(RootMeanSquare(c), 1e-3);
    ASSERT_FALSE(c.worst.empty());
  }
}

/// Runs `nonsense` as a kernel is run.
void Trapped(double (*nonsense)(double zero)) {
  const render::TrapGuard guard(10);
  const stages::FloatTraps traps;
  stages::CurrentTrapPlace() = {42, 7};
  volatile double zero = 0;
  zero = nonsense(zero);
}

TEST(HardRow48, NonsenseTrapsAndNamesThePath) {
  EXPECT_EXIT(Trapped([](double zero) { return zero / zero; }), testing::ExitedWithCode(1),
              "floating-point trap: invalid operation in pixel 2,4, sample 7");
  EXPECT_EXIT(Trapped([](double zero) { return 1 / zero; }), testing::ExitedWithCode(1),
              "division by zero");
  EXPECT_EXIT(Trapped([](double zero) { return (zero + 1e200) * 1e200; }),
              testing::ExitedWithCode(1), "overflow");
  EXPECT_EQ(fegetexcept(), 0);  // and outside nothing traps
}

}  // namespace
}  // namespace carpool::test
