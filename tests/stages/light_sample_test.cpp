// SampleLight over scenes of every kind of light: unbiased, with the densities that MIS asks for,
// and the fall-off of punctual lights.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "render/lights/environment.h"
#include "tests/stages/light_harness.h"
#include "tests/stages/light_scenes.h"
#include "tests/support/statistics.h"

namespace carpool::stages {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr float kLargestBelowOne = 0x1.fffffep-1f;

std::vector<LightQuery> WithRandomNumbers(const LightQuery& query, size_t count, uint32_t seed) {
  std::mt19937 rng(seed);
  std::vector<LightQuery> queries(count, query);
  const auto next = [&] { return static_cast<float>(rng() >> 8) * 0x1p-24f; };
  for (LightQuery& q : queries) {
    q.u_pick = next();
    for (float& u : q.u) u = next();
  }
  return queries;
}

/// A receiver at the origin that looks up.
LightQuery LookingUp() {
  LightQuery q;
  q.normal[1] = 1;
  return q;
}

/// What an estimate of irradiance gets from a sample; triangle lights of these tests all have
/// radiance `emission`.
double Irradiance(const LightResult& r, const LightQuery& q, double emission) {
  if (r.pdf == 0) return 0;
  const double cos =
      double{r.wi[0]} * q.normal[0] + double{r.wi[1]} * q.normal[1] + double{r.wi[2]} * q.normal[2];
  const bool triangle = r.light != kNone && !r.delta;
  return std::max(0.0, cos) * r.radiance[0] * (triangle ? emission : 1) / r.pdf;
}

double MeanIrradiance(const LightScene& s, const LightRunner& runner, const LightQuery& receiver,
                      double emission, test::Mean& estimate) {
  for (const LightResult& r :
       runner.run(LightKernel::sample_light, s.view, WithRandomNumbers(receiver, 50000, 61))) {
    estimate.Add(Irradiance(r, receiver, emission));
  }
  return estimate.Value();
}

/// A 2 x 2 m square at height 1 that shines down, of two triangles.
void AddSquare(LightScene& s, float luminance, bool faces_down, bool two_sided) {
  const std::array<float, 9> lower = {-1, 1, -1, 1, 1, -1, 1, 1, 1};
  const std::array<float, 9> upper = {-1, 1, -1, 1, 1, 1, -1, 1, 1};
  for (std::array<float, 9> p : {lower, upper}) {
    if (!faces_down) std::swap_ranges(p.begin() + 3, p.begin() + 6, p.begin() + 6);
    s.AddTriangle(p, luminance, two_sided);
  }
}
constexpr double kSquareIrradiance = 0.55413 * kPi;  // per unit of radiance

/// A uniform environment of radiance 0.25, a sun, a point, a spot and a square.
LightScene EveryKind() {
  LightScene s;
  render::BuildEnvironment(s.scene.lights.environment, 8, 4, std::vector<float>(96, 0.25f));
  AddSquare(s, 2, true, false);
  s.AddPunctual(LightType::point, {3, 4, 0}, 50);
  s.AddPunctual(LightType::directional, {0, 0, 0}, 1.5f);
  s.AddPunctual(LightType::directional, {0, 0, 0}, 0.5f);
  s.AddPunctual(LightType::spot, {0, 2, 0}, 6);
  s.punctual[1].direction[1] = -3;  // obliquely from above: cosine 3 / sqrt(10)
  s.punctual[2].direction[1] = 1;   // from below: nothing
  s.punctual[3].direction[1] = -1;
  s.punctual[3].direction[2] = 0;
  s.Build();
  return s;
}
double IrradianceOfEveryKind() {
  return 0.25 * kPi + 2 * kSquareIrradiance + 50.0 / 25 * 0.8 + 1.5 * 3 / std::sqrt(10.0) + 6.0 / 4;
}

TEST(LightSample, IrradianceOfEveryKindTogether) {
  const LightScene s = EveryKind();
  for (const LightRunner& runner : AllLightRunners()) {
    if (runner.name.ends_with("x1")) continue;  // the same bits: WidthDoesNotMatter
    for (const bool all_sides : {false, true}) {
      const LightQuery receiver = LookingUp();
      test::Mean estimate;
      auto queries = WithRandomNumbers(receiver, 200000, 62);
      if (all_sides) {
        for (LightQuery& q : queries) q.normal[1] = 0;
      }
      for (const LightResult& r : runner.run(LightKernel::sample_light, s.view, queries)) {
        estimate.Add(Irradiance(r, receiver, 2));
      }
      EXPECT_LT(estimate.Z(IrradianceOfEveryKind(), 2e-5), test::kLargestZ)
          << runner.name << " got " << estimate.Value() << " for " << IrradianceOfEveryKind();
    }
  }
}

TEST(LightSample, EachKindAloneGetsEverySample) {
  for (int kind = 0; kind < 4; ++kind) {
    LightScene s;
    double truth = 0;
    if (kind == 0) {
      render::BuildEnvironment(s.scene.lights.environment, 1, 1, {3, 3, 3});
      truth = 3 * kPi;
    } else if (kind == 1) {
      AddSquare(s, 2, true, false);
      truth = 2 * kSquareIrradiance;
    } else if (kind == 2) {
      s.AddPunctual(LightType::point, {0, 2, 0}, 4);
      truth = 1;
    } else {
      for (int i = 0; i < 3; ++i) {  // whose probabilities, 1/3 each, do not add up to 1 in float
        s.AddPunctual(LightType::directional, {0, 0, 0}, 2);
        s.punctual.back().direction[1] = -1;
        s.punctual.back().direction[2] = 0;
      }
      truth = 6;
    }
    s.Build();
    test::Mean estimate;
    MeanIrradiance(s, BestLightRunner(), LookingUp(), 2, estimate);
    EXPECT_LT(estimate.Z(truth, 1e-5), test::kLargestZ) << kind << " got " << estimate.Value();
    LightQuery q = LookingUp();
    for (const float u : {0.0f, kLargestBelowOne}) {
      q.u_pick = u;
      const auto r = BestLightRunner().run(LightKernel::sample_light, s.view, {q});
      EXPECT_GT(r[0].pdf, 0) << kind << ' ' << u;
    }
  }
}

TEST(LightSample, ALightWithOneSideGivesNothingBehindIt) {
  for (const bool two_sided : {false, true}) {
    for (const bool faces_down : {false, true}) {
      LightScene s;
      AddSquare(s, 1, faces_down, two_sided);
      s.Build();
      test::Mean estimate;
      const double mean = MeanIrradiance(s, BestLightRunner(), LookingUp(), 1, estimate);
      EXPECT_NEAR(mean, faces_down || two_sided ? kSquareIrradiance : 0, 0.02);
    }
  }
}

TEST(LightSample, DensitiesForMisAreFoundAgain) {
  LightScene s = RandomLights(400, 6, 63);
  render::BuildEnvironment(s.scene.lights.environment, 2, 1, {1, 0, 0, 0, 2, 0});
  s.Build();
  std::mt19937 rng(64);
  for (const LightRunner& runner : AllLightRunners()) {
    int triangles = 0, environments = 0;
    for (int i = 0; i < 40; ++i) {
      const LightQuery receiver = RandomReceiver(rng, i);
      const auto queries = WithRandomNumbers(receiver, 200, 65);
      const auto samples = runner.run(LightKernel::sample_light, s.view, queries);
      auto again = queries;
      for (size_t k = 0; k < samples.size(); ++k) {
        std::copy(samples[k].wi, samples[k].wi + 3, again[k].dir);
        again[k].distance = samples[k].distance;
        again[k].light = samples[k].light;
        if (samples[k].light == kNone || samples[k].delta) continue;
        const render::TriangleEmission& t = s.triangles[static_cast<size_t>(samples[k].light)];
        std::copy(t.p0, t.p0 + 3, again[k].p);
        std::copy(t.p1, t.p1 + 3, again[k].p + 3);
        std::copy(t.p2, t.p2 + 3, again[k].p + 6);
      }
      const auto hits = runner.run(LightKernel::triangle_hit_pdf, s.view, again);
      const auto misses = runner.run(LightKernel::environment_hit_pdf, s.view, again);
      for (size_t k = 0; k < samples.size(); ++k) {
        if (samples[k].pdf == 0 || samples[k].delta) continue;
        const bool environment = samples[k].light == kNone;
        (environment ? environments : triangles)++;
        const double found = environment ? misses[k].pdf : hits[k].pdf;
        ASSERT_NEAR(found / samples[k].pdf, 1, environment ? 1e-3 : 3e-5) << runner.name;
      }
    }
    EXPECT_GT(triangles, 500);
    EXPECT_GT(environments, 500);
  }
}

/// Irradiance that a single punctual light gives the origin.
float SinglePunctual(const LightRunner& runner, const render::PunctualInput& light) {
  LightScene s;
  s.punctual.push_back(light);
  s.Build();
  const auto r = runner.run(LightKernel::sample_light, s.view, {LightQuery{}});
  EXPECT_TRUE(r[0].pdf == 0 || (r[0].pdf == 1 && r[0].delta == 1));
  return r[0].pdf == 0 ? 0 : r[0].radiance[0];
}

TEST(LightSample, PunctualRangeFollowsTheExtension) {
  for (const LightRunner& runner : AllLightRunners()) {
    for (const double relative : {0.01, 0.5, 0.9, 0.999, 1.0, 1.5}) {
      render::PunctualInput p;
      p.position[0] = 3;
      p.intensity[0] = 18;
      p.range = static_cast<float>(3 / relative);
      const double window = std::max(0.0, 1 - std::pow(relative, 4));
      EXPECT_NEAR(SinglePunctual(runner, p), 2 * window, 1e-6) << runner.name << relative;
    }
  }
}

TEST(LightSample, SpotConeFollowsTheExtension) {
  for (const LightRunner& runner : AllLightRunners()) {
    for (const double angle : {0.0, 0.29, 0.31, 0.4, 0.49, 0.51, 1.0, 3.0}) {
      render::PunctualInput p;
      p.type = LightType::spot;
      p.position[1] = 2;
      p.intensity[0] = 4;
      p.inner_cone = 0.3f;
      p.outer_cone = 0.5f;
      p.direction[0] = static_cast<float>(std::sin(angle));
      p.direction[1] = static_cast<float>(-std::cos(angle));
      p.direction[2] = 0;
      const double t =
          std::clamp((std::cos(angle) - std::cos(0.5)) / (std::cos(0.3) - std::cos(0.5)), 0.0, 1.0);
      EXPECT_NEAR(SinglePunctual(runner, p), t * t, 2e-5) << runner.name << angle;
    }
  }
}

TEST(LightSample, AReceiverOnAPunctualLightGetsNoSample) {
  for (const LightRunner& runner : AllLightRunners()) {
    for (const LightType type : {LightType::point, LightType::spot}) {
      for (const float distance : {0.0f, 1e-38f, 1e-20f, 1e-14f}) {
        render::PunctualInput p;
        p.type = type;
        p.position[2] = distance;
        const float irradiance = SinglePunctual(runner, p);
        EXPECT_TRUE(std::isfinite(irradiance)) << runner.name << distance;
        EXPECT_EQ(irradiance == 0, distance < 1e-15f) << runner.name << distance;
      }
    }
  }
}

TEST(LightSample, InstancedTrianglesAreInTheWorldAndMirroredOnesTurnTheirFront) {
  LightScene s;
  AddSquare(s, 1, true, false);
  s.scene.geometry.placements.resize(1);
  Placement& place = s.scene.geometry.placements[0];
  place.flags = kPlacementInstanced | kPlacementMirrored;
  const float to_world[12] = {-1, 0, 0, 0, 0, 1, 0, 0.5f, 0, 0, 1, 0};  // mirrors x, lifts by 0.5
  std::copy(to_world, to_world + 12, place.object_to_world);
  const auto object = s.triangles;
  for (render::TriangleEmission& t : s.triangles) {
    for (float* p : {t.p0, t.p1, t.p2}) {
      p[0] = -p[0];
      p[1] += 0.5f;
    }
  }
  s.Build();
  for (const LightRunner& runner : AllLightRunners()) {
    LightQuery q = LookingUp();
    q.primitive = 1;
    const auto r = runner.run(LightKernel::triangle_vertices, s.view, {q});
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(r[0].wi[i], s.triangles[1].p0[i]);
      EXPECT_EQ(r[0].radiance[i], s.triangles[1].p1[i]);
      EXPECT_EQ(r[0].third[i], s.triangles[1].p2[i]);
    }
    EXPECT_EQ(r[0].delta, 1);  // mirrored
    test::Mean below, above;
    EXPECT_GT(MeanIrradiance(s, runner, q, 1, below), 0.5);
    q.position[1] = 3;
    q.normal[1] = -1;
    EXPECT_EQ(MeanIrradiance(s, runner, q, 1, above), 0);
  }
}

TEST(LightSample, WithoutLightsThereIsNoSample) {
  LightScene s;
  s.Build();
  for (const LightRunner& runner : AllLightRunners()) {
    const auto r = runner.run(LightKernel::sample_light, s.view, WithRandomNumbers({}, 33, 66));
    for (const LightResult& sample : r) EXPECT_EQ(sample.pdf, 0);
    EXPECT_EQ(runner.run(LightKernel::triangle_hit_pdf, s.view, {LightQuery{}})[0].pdf, 0);
    EXPECT_EQ(runner.run(LightKernel::environment_hit_pdf, s.view, {LightQuery{}})[0].pdf, 0);
  }
}

TEST(LightSample, WidthDoesNotMatter) {
  LightScene s = RandomLights(1000, 12, 67);
  render::BuildEnvironment(s.scene.lights.environment, 2, 1, {1, 0, 0, 0, 2, 0});
  s.AddPunctual(LightType::directional, {0, 0, 0}, 1);
  s.Build();
  std::mt19937 rng(68);
  std::vector<LightQuery> queries;
  for (int i = 0; i < 300; ++i) {
    for (const LightQuery& q : WithRandomNumbers(RandomReceiver(rng, i), 9, rng())) {
      queries.push_back(q);
    }
  }
  const auto runners = AllLightRunners();
  for (size_t i = 0; i + 1 < runners.size(); i += 2) {
    EXPECT_EQ(runners[i].run(LightKernel::sample_light, s.view, queries),
              runners[i + 1].run(LightKernel::sample_light, s.view, queries))
        << runners[i].target;
  }
}

}  // namespace
}  // namespace carpool::stages
