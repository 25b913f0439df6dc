// Small scenes that emit, built through the same builders as real ones.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "render/lights/light_tree.h"
#include "tests/stages/light_harness.h"

namespace carpool::stages {

/// Collects emitters, then builds the tables. All triangles are one flat placement.
struct LightScene {
  SceneTables scene;
  std::vector<render::TriangleEmission> triangles;
  std::vector<render::PunctualInput> punctual;
  LightView view;

  void AddTriangle(const std::array<float, 9>& p, float luminance, bool two_sided) {
    render::TriangleEmission t;
    t.primitive = static_cast<int32_t>(triangles.size());
    for (int i = 0; i < 3; ++i) {
      t.p0[i] = p[i];
      t.p1[i] = p[3 + i];
      t.p2[i] = p[6 + i];
    }
    t.radiance_luminance = luminance;
    t.two_sided = two_sided;
    triangles.push_back(t);
    for (int i = 0; i < 3; ++i) {
      scene.geometry.vertices.push_back({.position = {p[3 * i], p[3 * i + 1], p[3 * i + 2]}});
      scene.geometry.indices.push_back(static_cast<uint32_t>(3 * t.primitive + i));
    }
  }
  void AddPunctual(LightType type, const std::array<float, 3>& position, float intensity) {
    render::PunctualInput p;
    p.type = type;
    for (int i = 0; i < 3; ++i) {
      p.position[i] = position[i];
      p.intensity[i] = intensity;
    }
    punctual.push_back(p);
  }
  void Build() {
    scene.geometry.placements.resize(1);
    scene.geometry.indices.resize(scene.geometry.indices.size() + 1);  // kernels load 16 bytes
    render::BuildLightTree(scene, triangles, punctual);
    view = LightViewOf(scene);
  }
};

/// `count` emitters within a cube of 20 m, their powers spread evenly over so many decades: two
/// thirds are triangles of all orientations and sides, the rest points and spots.
inline LightScene RandomLights(int count, double decades, uint32_t seed) {
  LightScene s;
  std::mt19937 rng(seed);
  std::uniform_real_distribution<float> in_cube(-10, 10), small(-0.3f, 0.3f), half(-1, 1);
  std::uniform_real_distribution<double> decade(-decades / 2, decades / 2);
  for (int i = 0; i < count; ++i) {
    const float power = static_cast<float>(std::pow(10.0, decade(rng)));
    const std::array<float, 3> at = {in_cube(rng), in_cube(rng), in_cube(rng)};
    if (i % 3 != 2) {
      std::array<float, 9> p;
      for (int k = 0; k < 9; ++k) p[k] = at[k % 3] + small(rng);
      s.AddTriangle(p, power, i % 2 == 0);
    } else {
      s.AddPunctual(i % 2 == 0 ? LightType::spot : LightType::point, at, power);
      for (float& c : s.punctual.back().direction) c = half(rng);
      s.punctual.back().inner_cone = 0.1f * static_cast<float>(i % 7);
      s.punctual.back().outer_cone = s.punctual.back().inner_cone + 0.2f;
    }
  }
  s.Build();
  return s;
}

/// A receiver somewhere among them; every other one takes light from all sides.
inline LightQuery RandomReceiver(std::mt19937& rng, int index) {
  std::uniform_real_distribution<float> in_cube(-12, 12), half(-1, 1);
  LightQuery q;
  for (float& c : q.position) c = in_cube(rng);
  if (index % 2 == 0) {
    float length = 0;
    for (float& c : q.normal) {
      c = half(rng);
      length += c * c;
    }
    for (float& c : q.normal) c /= std::sqrt(length);
  }
  return q;
}

}  // namespace carpool::stages
