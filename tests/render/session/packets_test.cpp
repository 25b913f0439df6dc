// Rays get the same bits from packets, whatever their mates, as each gets alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>
#include <random>

#include "render/session/workspace.h"
#include "stages/simd/denormals.h"
#include "tests/render/session/busy_scene.h"

namespace carpool::test {
namespace {

using stages::PathState;

constexpr size_t kRays = 20'011;  // no multiple of any packet

std::array<float, 3> UnitVector(std::mt19937& dice) {
  std::normal_distribution<float> normal;
  std::array<float, 3> v = {normal(dice), normal(dice), normal(dice)};
  if (dice() % 16 == 0) v = {0, 0, v[2] < 0 ? -1.0f : 1.0f};  // along an axis, and the walls
  const float length = std::hypot(v[0], v[1], v[2]);
  for (float& x : v) x /= length;
  return v;
}

/// Rays all over the scene, a third of them on their way through a place that they have met.
std::vector<PathState> RandomPaths() {
  std::mt19937 dice(5);
  std::uniform_real_distribution<float> place(-1.9f, 1.9f);
  std::vector<PathState> paths(kRays);
  for (PathState& path : paths) {
    path = {};
    for (float& x : path.origin) x = place(dice);
    std::ranges::copy(UnitVector(dice), path.direction);
    path.placement = stages::kNone;
    std::ranges::copy(UnitVector(dice), path.shadow_direction);
    path.shadow_distance = 3;
    std::fill_n(path.shadow_radiance, 3, 1.0f);
  }
  return paths;
}

/// The slots in an order of their own, so that each ray meets other mates than its neighbours.
std::vector<uint32_t> MixedSlots(uint32_t seed) {
  std::vector<uint32_t> slots(kRays);
  std::iota(slots.begin(), slots.end(), 0u);
  std::shuffle(slots.begin(), slots.end(), std::mt19937(seed));
  return slots;
}

size_t CountDifferent(const std::vector<PathState>& a, const std::vector<PathState>& b) {
  size_t count = 0;
  for (size_t i = 0; i < a.size(); ++i) count += std::memcmp(&a[i], &b[i], sizeof a[i]) != 0;
  return count;
}

void ExpectSameFromPackets(const render::Workspace& workspace) {
  const stages::FlushDenormals denormals;
  const stages::KernelContext& c = workspace.context();
  const stages::OpacityQuery opacity = {&c, workspace.kernels().opacity};

  std::vector<PathState> alone = RandomPaths(), packed = alone;
  for (PathState& path : alone) stages::TraceShadow(c.trace, opacity, path);
  stages::TraceShadows(c.trace, opacity, packed.data(), MixedSlots(1));
  EXPECT_EQ(CountDifferent(alone, packed), 0u) << "shadow rays";
  const auto lit = [](const PathState& path) { return path.radiance[0] > 0; };
  EXPECT_GT(std::ranges::count_if(alone, lit), 1000);

  for (uint32_t hit = 0; hit < 3; ++hit) {  // on through what they meet
    for (PathState& path : alone) stages::IntersectPath(c.trace, path);
    stages::IntersectPaths(c.trace, packed.data(), MixedSlots(2 + hit));
    EXPECT_EQ(CountDifferent(alone, packed), 0u) << "hit " << hit;
    for (std::vector<PathState>* paths : {&alone, &packed}) {
      for (PathState& path : *paths) {
        if (path.placement >= 0) path.flags += 1u << stages::kPathLayerShift;
      }
    }
  }
  const auto went_through = [](const PathState& path) {
    return path.flags >> stages::kPathLayerShift >= 2;
  };
  EXPECT_GT(std::ranges::count_if(alone, went_through), 300);
}

TEST(Packets, GiveEachRayWhatItGetsAlone) {
  const ScratchFolder folder;
  render::RenderSettings settings;
  settings.scene_path = BusyScene(folder.path()).string();
  settings.threads = 1;
  render::Threads threads(1);
  for (const stages::Kernels& kernels : stages::AvailableKernels()) {
    settings.isa = render::ParseIsa(kernels.isa);
    for (const bool robust : {true, false}) {
      SCOPED_TRACE(std::string(kernels.isa) + (robust ? ", robust" : ", not robust"));
      settings.robust = robust;
      const render::Workspace workspace(render::LoadScene(settings, {}), settings, threads);
      ExpectSameFromPackets(workspace);
    }
  }
}

}  // namespace
}  // namespace carpool::test
