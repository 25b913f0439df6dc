// Picking from the light tree: probabilities that add up, agree with what is picked, and starve no
// light that contributes (HARD_CASES 33, 46).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "tests/stages/light_harness.h"
#include "tests/stages/light_scenes.h"
#include "tests/support/statistics.h"

namespace carpool::stages {
namespace {

constexpr float kLargestBelowOne = 0x1.fffffep-1f;

/// The probability of each light of the scene from one receiver.
std::vector<double> Probabilities(const LightRunner& runner, const LightScene& s,
                                  const LightQuery& receiver) {
  std::vector<LightQuery> queries(s.scene.lights.lights.size(), receiver);
  for (size_t i = 0; i < queries.size(); ++i) queries[i].light = static_cast<int32_t>(i);
  std::vector<double> result;
  for (const LightResult& r : runner.run(LightKernel::pick_probability, s.view, queries)) {
    result.push_back(r.pdf);
  }
  return result;
}

std::vector<LightQuery> WithPickNumbers(const LightQuery& receiver, size_t count, uint32_t seed) {
  std::mt19937 rng(seed);
  std::vector<LightQuery> queries(count, receiver);
  for (LightQuery& q : queries) q.u_pick = static_cast<float>(rng() >> 8) * 0x1p-24f;
  return queries;
}

TEST(LightTree, ProbabilitiesSumToOneOverTwelveDecades) {
  const LightScene s = RandomLights(100000, 12, 31);
  std::mt19937 rng(32);
  for (const LightRunner& runner : AllLightRunners()) {
    if (runner.name.ends_with("x1")) continue;  // the same bits: WidthDoesNotMatter
    for (int i = 0; i < 2; ++i) {
      const LightQuery receiver = RandomReceiver(rng, i);
      double sum = 0;
      for (const double p : Probabilities(runner, s, receiver)) sum += p;
      // What is missing is the share of clusters that turn out, further down, to shine elsewhere.
      double nothing = 0;
      const auto picks =
          runner.run(LightKernel::pick_light, s.view, WithPickNumbers(receiver, 100000, 33));
      for (const LightResult& r : picks) nothing += r.light == kNone;
      nothing /= static_cast<double>(picks.size());
      const double error = std::sqrt(std::max(nothing, 1e-5) / static_cast<double>(picks.size()));
      EXPECT_NEAR(sum + nothing, 1, test::kLargestZ * error) << runner.name;
    }
  }
}

TEST(LightTree, ProbabilitiesSumToOneExactlyWhereAllLightsShineEverywhere) {
  LightScene s;
  std::mt19937 rng(34);
  std::uniform_real_distribution<float> in_cube(-10, 10);
  std::uniform_real_distribution<double> decade(-6, 6);
  for (int i = 0; i < 100000; ++i) {
    s.AddPunctual(LightType::point, {in_cube(rng), in_cube(rng), in_cube(rng)},
                  static_cast<float>(std::pow(10.0, decade(rng))));
  }
  s.Build();
  for (const LightRunner& runner : AllLightRunners()) {
    if (runner.name.ends_with("x1")) continue;  // the same bits: WidthDoesNotMatter
    double sum = 0;
    for (const double p : Probabilities(runner, s, RandomReceiver(rng, 0))) {
      ASSERT_GT(p, 0);
      sum += p;
    }
    EXPECT_NEAR(sum, 1, 1e-6) << runner.name;
  }
}

TEST(LightTree, PicksFollowTheProbabilities) {
  constexpr size_t kPicks = 500000;
  const LightScene few = RandomLights(300, 12, 35), many = RandomLights(20000, 3, 36);
  std::mt19937 rng(37);
  for (const LightScene* s : {&few, &many}) {
    for (int i = 0; i < 2; ++i) {
      const LightQuery receiver = RandomReceiver(rng, i);
      std::vector<double> expected = Probabilities(BestLightRunner(), *s, receiver);
      double sum = 0;
      for (double& e : expected) sum += e, e *= kPicks;
      expected.push_back(std::max(0.0, 1 - sum) * kPicks);  // none
      if (expected.back() < 1e-4 * kPicks) expected.back() = 0;
      std::vector<double> counts(expected.size());
      for (const LightResult& r : BestLightRunner().run(
               LightKernel::pick_light, s->view,
               WithPickNumbers(receiver, kPicks, static_cast<uint32_t>(38 + i)))) {
        ++counts[r.light == kNone ? counts.size() - 1 : static_cast<size_t>(r.light)];
      }
      EXPECT_GT(test::ChiSquaredTest(counts, expected), test::kFalseAlarm);
    }
  }
}

TEST(LightTree, PickAndProbabilityAgree) {
  const LightScene s = RandomLights(5000, 12, 42);
  std::mt19937 rng(43);
  std::vector<LightQuery> queries;
  for (int i = 0; i < 20000; ++i) {
    queries.push_back(RandomReceiver(rng, i));
    queries.back().u_pick = i == 0   ? 0
                            : i == 1 ? kLargestBelowOne
                                     : static_cast<float>(rng() >> 8) * 0x1p-24f;
  }
  for (const LightRunner& runner : AllLightRunners()) {
    const auto picks = runner.run(LightKernel::pick_light, s.view, queries);
    auto again = queries;
    for (size_t i = 0; i < picks.size(); ++i) again[i].light = picks[i].light;
    const auto found = runner.run(LightKernel::pick_probability, s.view, again);
    int picked = 0;
    for (size_t i = 0; i < picks.size(); ++i) {
      ASSERT_GE(picks[i].u, 0);
      ASSERT_LT(picks[i].u, 1);
      if (picks[i].light == kNone) {
        ASSERT_EQ(picks[i].pdf, 0);
        ASSERT_EQ(found[i].pdf, 0);
        continue;
      }
      ++picked;
      ASSERT_NEAR(found[i].pdf / picks[i].pdf, 1, 1e-5) << runner.name;
    }
    EXPECT_GT(picked, 15000);
  }
}

TEST(LightTree, TheRemappedNumberIsUniform) {
  constexpr size_t kPicks = 400000;
  const LightScene s = RandomLights(3000, 6, 44);
  std::mt19937 rng(45);
  std::vector<double> expected(64, kPicks / 64.0), counts(64);
  for (const LightResult& r : BestLightRunner().run(
           LightKernel::pick_light, s.view, WithPickNumbers(RandomReceiver(rng, 1), kPicks, 46))) {
    ++counts[static_cast<size_t>(r.u * 64)];
  }
  EXPECT_GT(test::ChiSquaredTest(counts, expected), test::kFalseAlarm);
}

/// Whether the middle or a corner of the light shines on the receiver at all.
bool Shines(const LightScene& s, size_t light, const LightQuery& q) {
  const auto towards = [&](const float from[3], const float n[3]) {
    double cos = 0, length = 0;
    for (int i = 0; i < 3; ++i) {
      const double c = double{q.position[i]} - from[i];
      cos += c * n[i];
      length += c * c;
    }
    return cos / std::sqrt(length);
  };
  const Light& record = s.scene.lights.lights[light];
  if (record.type == LightType::point) return true;
  if (record.type == LightType::spot) {
    return towards(record.punctual.position, record.punctual.direction) >
           record.punctual.cos_outer + 1e-6;
  }
  const render::TriangleEmission& t = s.triangles[light];
  double e[3], f[3];
  for (int i = 0; i < 3; ++i) e[i] = t.p1[i] - t.p0[i], f[i] = t.p2[i] - t.p0[i];
  const float n[3] = {static_cast<float>(e[1] * f[2] - e[2] * f[1]),
                      static_cast<float>(e[2] * f[0] - e[0] * f[2]),
                      static_cast<float>(e[0] * f[1] - e[1] * f[0])};
  return t.two_sided || towards(t.p0, n) > 1e-6;
}

TEST(LightTree, NoLightThatContributesIsImpossible) {
  const LightScene s = RandomLights(2000, 24, 47);
  std::mt19937 rng(48);
  size_t shining = 0, impossible = 0;
  for (int i = 0; i < 100; ++i) {
    const LightQuery receiver = RandomReceiver(rng, i);
    const auto p = Probabilities(BestLightRunner(), s, receiver);
    for (size_t light = 0; light < p.size(); ++light) {
      impossible += p[light] == 0;
      if (!Shines(s, light, receiver)) continue;
      ++shining;
      ASSERT_GT(p[light], 0) << "light " << light << " from receiver " << i;
    }
  }
  EXPECT_GT(shining, 50000u);
  EXPECT_GT(impossible, 20000u);  // and the tree does cull: a third of triangles and most spots
}

/// Two narrow spots in a row shine along +X; seen from the middle between them, a receiver just
/// before the first lies towards -X, and yet the first shines on it.
TEST(LightTree, AClusterAroundTheReceiverIsNeverCulled) {
  LightScene s;
  for (const float x : {-1.0f, 1.0f, 1000.0f}) {
    s.AddPunctual(LightType::spot, {x, 0, 0}, 1);
    render::PunctualInput& spot = s.punctual.back();
    spot.direction[0] = 1;
    spot.direction[2] = 0;
    spot.inner_cone = 0.05f;
    spot.outer_cone = 0.1f;
  }
  s.Build();
  LightQuery receiver;
  receiver.position[0] = -0.5f;
  for (const LightRunner& runner : AllLightRunners()) {
    EXPECT_GT(Probabilities(runner, s, receiver)[0], 0.5) << runner.name;
  }
}

TEST(LightTree, NearLightsArePreferred) {
  LightScene s;
  for (int i = 0; i < 64; ++i) {
    s.AddPunctual(LightType::point, {static_cast<float>(i), 0, 0}, 1);
  }
  s.Build();
  LightQuery receiver;
  receiver.position[0] = 20.1f;
  receiver.position[1] = 0.3f;
  const auto p = Probabilities(BestLightRunner(), s, receiver);
  EXPECT_EQ(std::max_element(p.begin(), p.end()) - p.begin(), 20);
  EXPECT_GT(p[20], 0.25);  // 1/64 by power alone
}

TEST(LightTree, SizeOfTheWorldDoesNotMatter) {
  std::mt19937 rng(49);
  const LightScene one = RandomLights(2000, 6, 50);
  for (const float scale : {0x1p-20f, 0x1p20f}) {  // nodes round alike at powers of two
    LightScene scaled;
    for (render::TriangleEmission t : one.triangles) {
      std::array<float, 9> p;
      for (int i = 0; i < 3; ++i) {
        p[i] = t.p0[i] * scale;
        p[3 + i] = t.p1[i] * scale;
        p[6 + i] = t.p2[i] * scale;
      }
      scaled.AddTriangle(p, t.radiance_luminance, t.two_sided);
    }
    for (render::PunctualInput p : one.punctual) {
      for (int i = 0; i < 3; ++i) {
        p.position[i] *= scale;
        p.intensity[i] *= scale * scale;
      }
      scaled.punctual.push_back(p);
    }
    scaled.Build();
    for (int i = 0; i < 10; ++i) {
      LightQuery receiver = RandomReceiver(rng, i);
      const auto expected = Probabilities(BestLightRunner(), one, receiver);
      for (float& c : receiver.position) c *= scale;
      const auto found = Probabilities(BestLightRunner(), scaled, receiver);
      double difference = 0;
      for (size_t k = 0; k < found.size(); ++k) difference += std::abs(found[k] - expected[k]);
      EXPECT_LT(difference, 1e-3) << scale;
    }
  }
}

TEST(LightTree, ReceiversOnALightGetFiniteProbabilities) {
  const LightScene s = RandomLights(500, 12, 51);
  for (const LightRunner& runner : AllLightRunners()) {
    for (size_t light = 0; light < s.scene.lights.lights.size(); light += 7) {
      LightQuery receiver;
      const Light& record = s.scene.lights.lights[light];
      const float* at = IsTriangle(record.type) ? s.triangles[light].p0 : record.punctual.position;
      std::copy(at, at + 3, receiver.position);
      double sum = 0;
      for (const double p : Probabilities(runner, s, receiver)) sum += p;
      ASSERT_GT(sum, 0) << runner.name;
      ASSERT_LT(sum, 1 + 1e-5) << runner.name;
    }
  }
}

TEST(LightTree, WithoutLightsThereIsNoPick) {
  LightScene none, one;
  none.Build();
  one.AddPunctual(LightType::point, {1, 2, 3}, 5);
  one.Build();
  for (const LightRunner& runner : AllLightRunners()) {
    const auto nothing = runner.run(LightKernel::pick_light, none.view, {LightQuery{}});
    EXPECT_EQ(nothing[0].light, kNone);
    EXPECT_EQ(nothing[0].pdf, 0);
    EXPECT_EQ(runner.run(LightKernel::pick_probability, none.view, {LightQuery{}})[0].pdf, 0);
    const auto only = runner.run(LightKernel::pick_light, one.view, {LightQuery{}});
    EXPECT_EQ(only[0].light, 0);
    EXPECT_EQ(only[0].pdf, 1);
    EXPECT_EQ(runner.run(LightKernel::pick_probability, one.view, {LightQuery{}})[0].pdf, 1);
  }
}

TEST(LightTree, WidthDoesNotMatter) {
  const LightScene s = RandomLights(3000, 12, 52);
  std::mt19937 rng(53);
  std::vector<LightQuery> queries;
  for (int i = 0; i < 2003; ++i) {
    queries.push_back(RandomReceiver(rng, i));
    queries.back().u_pick = static_cast<float>(rng() >> 8) * 0x1p-24f;
    queries.back().light = static_cast<int32_t>(rng() % 3000);
  }
  const auto runners = AllLightRunners();
  for (size_t i = 0; i + 1 < runners.size(); i += 2) {
    for (const LightKernel kernel : {LightKernel::pick_light, LightKernel::pick_probability}) {
      EXPECT_EQ(runners[i].run(kernel, s.view, queries),
                runners[i + 1].run(kernel, s.view, queries))
          << runners[i].target;
    }
  }
}

}  // namespace
}  // namespace carpool::stages
