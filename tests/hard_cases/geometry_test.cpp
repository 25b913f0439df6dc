// Rows 1 to 6: rays against triangles, from millimetres to kilometres, near the origin and far.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/hard_cases/checks.h"
#include "tests/hard_cases/rays.h"

namespace carpool::test {
namespace {

using stages::PathState;

TEST(HardRow01, AClosedSphereDoesNotLeak) {
  constexpr uint64_t kRays = 1'000'000;
  for (const double offset : {0.0, 1e2, 1e4, 1e6}) {
    const LoadedCase scene(FarSphere(1, offset));
    ExpectRate("row 1, leaks of a closed sphere at " + std::to_string(offset) + " m",
               CountLeaks(scene, 1, offset, kRays), kRays, 1e-6);
  }
}

/// Embree's ROBUST mode is not quite watertight where it is aimed at exactly: the rates are
/// published limits (4.5e-5 of edges, 1.8 % of vertices).
TEST(HardRow02, RaysAtSharedEdgesAndVerticesHit) {
  const LoadedCase scene(FarSphere(1, 0));
  constexpr uint64_t kRays = 1'000'000;
  std::mt19937 rng(2);
  std::uniform_int_distribution<uint32_t> triangle(0, 159'199);
  std::uniform_real_distribution<double> unit(0, 1);
  uint64_t edges = 0, vertices = 0;
  for (uint64_t i = 0; i < kRays; ++i) {
    const uint32_t t = triangle(rng);
    const Point a = scene.Corner(0, t, 0), b = scene.Corner(0, t, 1);
    const Point from = 0.2 * RandomDirection(rng);
    const Point at_edge = a + unit(rng) * (b - a) - from, at_vertex = a - from;
    PathState edge = RayFrom(from, 1 / Length(at_edge) * at_edge, 0);
    PathState vertex = RayFrom(from, 1 / Length(at_vertex) * at_vertex, 0);
    scene.Trace(edge);
    scene.Trace(vertex);
    edges += edge.placement < 0;
    vertices += vertex.placement < 0;
  }
  ExpectRate("row 2, misses at shared edges", edges, kRays, 4.5e-5);
  ExpectRate("row 2, misses at shared vertices", vertices, kRays, 1.8e-2);
}

std::string Place(double size, double offset) {
  char text[64];
  std::snprintf(text, sizeof text, "triangles of %g m at %g m", size, offset);
  return text;
}

/// Triangles at least 64 steps of the float grid large, so that they are triangles still.
TEST(HardRow03, NoRayHitsTheTriangleItLeaves) {
  for (const double offset : {0.0, 1.0, 1e3, 1e5}) {
    for (const double size : {1e-3, 1.0, 1e3}) {
      if (size < 64 * 0x1p-23 * offset) continue;
      const Scattered s = ScatterAll(LoadedCase(Soup(size, offset, false)), size, 100'000);
      ASSERT_GT(s.rays, 20'000u);
      ExpectRate("row 3, self-hits of " + Place(size, offset), s.self_hits, s.rays, 1e-6);
      EXPECT_EQ(s.wrong_side, 0u) << Place(size, offset);
    }
  }
}

/// Row 6, and the other half of row 3: origins move no further than stated.
TEST(HardRow06, OriginsStayWithinTheStatedBound) {
  for (const bool needles : {false, true}) {
    for (const double offset : {0.0, 10.0, 1e3}) {
      const Scattered s = ScatterAll(LoadedCase(Soup(1, offset, needles)), 1, 100'000);
      EXPECT_LE(s.worst_offset, 1) << Place(1, offset) << (needles ? ", needles" : "");
      ExpectRate("row 6, self-hits of " + std::string(needles ? "needle " : "") + Place(1, offset),
                 s.self_hits, s.rays, 1e-6);
    }
  }
}

/// Row 4: a dark room in a lamp; the wall between them is as thin as stated bounds allow.
TEST(HardRow04, ALampBehindAWallGivesExactlyNothing) {
  for (const double half : {1.0, 1e3}) {
    for (const bool turned : {false, true}) {
      SceneCase c{.name = "dark_room"};
      SceneBuilder& b = c.scene;
      // Shadow rays end 2^-19 (distance + largest coordinates) before a light: 7.5 half at most.
      const double gap = half * 0x1p-16;
      const nlohmann::json turn = turned
                                      ? nlohmann::json{0.1825742, 0.3651484, 0.5477226, 0.7302967}
                                      : nlohmann::json{0, 0, 0, 1};
      b.AddNode(
          {{"mesh", b.AddBox(half, b.AddLambert({0.9, 0.9, 0.9}), true)}, {"rotation", turn}});
      b.AddNode({{"mesh", b.AddBox(half + gap, b.AddLambert({0, 0, 0}, {1, 1, 1}, 1000), true)},
                 {"rotation", turn}});
      b.AddCamera({0.3 * half, 0.1 * half, 0}, 1.5);
      c.settings = HardSettings(256, 16);
      const Mean dark = CaseRenderer(c).Seeds(kFirstSeed, 4);
      EXPECT_EQ(dark.Value(), 0) << "room of " << half << " m" << (turned ? ", turned" : "")
                                 << "\n  alone: " << RenderCommand(c, kFirstSeed);
    }
  }
}

}  // namespace
}  // namespace carpool::test
