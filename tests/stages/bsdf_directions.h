// Directions, uniform numbers and materials that the BSDF tests share.
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "tests/stages/bsdf_kernels.h"

namespace carpool::tests {

/// wo at cosine mu, at an azimuth that favours no axis.
inline Direction OutgoingAt(double mu) {
  const double sine = std::sqrt((1 - mu) * (1 + mu));
  return {static_cast<float>(0.6 * sine), static_cast<float>(-0.8 * sine), static_cast<float>(mu)};
}

/// `columns` columns of independent numbers on the samplers' 2^-24 grid.
inline Columns IndependentUniforms(size_t columns, size_t count, uint32_t seed) {
  std::mt19937 random(seed);
  Columns u(columns, std::vector<double>(count));
  for (auto& column : u) {
    for (double& value : column) value = (random() >> 8) * 0x1p-24;
  }
  return u;
}

/// u for SampleBsdf from the renderer's sampler: one scramble per `scramble`.
inline Columns SamplerUniforms(uint32_t scramble, uint32_t count) {
  Draws draws;
  for (uint32_t i = 0; i < count; ++i) {
    draws.pixel.push_back(scramble / 4);
    draws.sample.push_back(i * 4 + scramble % 4);
    draws.vertex.push_back(1);
  }
  draws.purpose = stages::Purpose::lobe;
  Columns u{BestSamplingKernels().sample1(draws)};
  draws.purpose = stages::Purpose::bsdf;
  for (auto& column : BestSamplingKernels().sample2(draws)) u.push_back(std::move(column));
  return u;
}

inline Columns RandomHemisphere(size_t count, uint32_t seed) {
  const Columns u = IndependentUniforms(2, count, seed);
  Columns w(3, std::vector<double>(count));
  for (size_t i = 0; i < count; ++i) {
    // Cubed, so that grazing directions are common.
    const double z = std::pow((u[0][i] * (1 << 24) + 1) * 0x1p-24, 3);
    const double sine = std::sqrt((1 - z) * (1 + z)), angle = 2 * std::numbers::pi * u[1][i];
    w[0][i] = static_cast<float>(sine * std::cos(angle));
    w[1][i] = static_cast<float>(sine * std::sin(angle));
    w[2][i] = static_cast<float>(z);
  }
  return w;
}

inline Surface WhiteDielectric(double roughness) {
  Surface s;
  s.name = "white dielectric, roughness " + std::to_string(roughness);
  s.roughness = roughness;
  return s;
}
inline Surface WhiteMetal(double roughness) {
  Surface s = WhiteDielectric(roughness);
  s.name = "white metal, roughness " + std::to_string(roughness);
  s.metallic = 1;
  return s;
}
/// Colours, half metal, tinted specular: every term at work.
inline Surface Mixed(double roughness) {
  Surface s;
  s.name = "mixed, roughness " + std::to_string(roughness);
  s.base[0] = 0.8, s.base[1] = 0.4, s.base[2] = 0.1;
  s.metallic = 0.4;
  s.roughness = roughness;
  s.ior = 1.7;
  s.specular = 0.8;
  s.specular_color[0] = 0.3, s.specular_color[1] = 1, s.specular_color[2] = 2;
  return s;
}

}  // namespace carpool::tests
