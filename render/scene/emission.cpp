// World-space emissive triangles and the mean of their emissive texture.
#include "render/scene/emission.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "stages/tables/srgb.h"

namespace carpool::render {
namespace {

using stages::GeometryTables;
using stages::kNone;
using stages::Material;
using stages::Placement;
using stages::SceneTables;
using stages::Texture;
using stages::TextureSlot;

double Luminance(const std::array<double, 3>& c) {
  return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
}

struct Uv {
  double u = 0, v = 0;
};

Uv VertexUv(const GeometryTables& g, const Placement& p, uint32_t vertex, int32_t set) {
  if (set >= p.uv_sets) return {};
  const float* const uv =
      set == 0 ? g.vertices[static_cast<size_t>(p.first_vertex) + vertex].uv
               : &g.floats[p.more_uvs + (size_t{vertex} * (p.uv_sets - 1) + (set - 1)) * 2];
  return {uv[0], uv[1]};
}

double ChannelOf(const stages::TextureTables& t, const Texture& texture, size_t word, int channel) {
  if (texture.format == stages::TexelFormat::rgba16) {
    const uint32_t code = (t.words[word + channel / 2] >> (channel % 2 * 16)) & 0xffff;
    return texture.srgb != 0 ? stages::SrgbDecode16()[code] : code / 65535.0;
  }
  const uint32_t code = (t.words[word] >> (8 * channel)) & 0xff;
  return texture.srgb != 0 ? stages::SrgbDecode8()[code] : code / 255.0;
}

size_t Wrapped(double unit, int size, int32_t mode) {
  double turn = unit - std::floor(unit);
  if (mode == stages::kWrapClamp) turn = std::clamp(unit, 0.0, 1.0);
  if (mode == stages::kWrapMirror && std::fmod(std::floor(unit), 2.0) != 0) turn = 1 - turn;
  if (!std::isfinite(turn)) turn = 0;
  return static_cast<size_t>(std::clamp(static_cast<int>(turn * size), 0, size - 1));
}

/// Mean luminance of a texture over a triangle: 16 points of the mip level whose texels are about a
/// quarter of the triangle's extent.
double MeanTexture(const SceneTables& scene, const TextureSlot& slot,
                   const std::array<Uv, 3>& corners, const float factor[3]) {
  const Texture& texture = scene.textures.textures[slot.texture];
  std::array<Uv, 3> uv;
  for (int i = 0; i < 3; ++i) {
    const float* m = slot.transform;
    const Uv& in = corners[i];
    uv[i] = slot.has_transform != 0
                ? Uv{m[0] * in.u + m[1] * in.v + m[2], m[3] * in.u + m[4] * in.v + m[5]}
                : in;
  }
  const auto extent = [&](double Uv::*axis) {
    return std::max({uv[0].*axis, uv[1].*axis, uv[2].*axis}) -
           std::min({uv[0].*axis, uv[1].*axis, uv[2].*axis});
  };
  const double texels = std::max(extent(&Uv::u) * texture.width, extent(&Uv::v) * texture.height);
  const double wanted = std::log2(std::max(texels / 4, 1.0));
  const int level =
      std::isfinite(wanted) ? std::clamp(static_cast<int>(wanted), 0, texture.levels - 1) : 0;
  const int width = std::max(1, texture.width >> level),
            height = std::max(1, texture.height >> level);
  const int words = texture.format == stages::TexelFormat::rgba16 ? 2 : 1;
  double sum = 0;
  constexpr int kAcross = 4;
  for (int i = 0; i < kAcross * kAcross; ++i) {
    const double s = std::sqrt((i / kAcross + 0.5) / kAcross), t = (i % kAcross + 0.5) / kAcross;
    const double b0 = 1 - s, b1 = s * (1 - t), b2 = s * t;
    const size_t x = Wrapped(b0 * uv[0].u + b1 * uv[1].u + b2 * uv[2].u, width, slot.wrap_s);
    const size_t y = Wrapped(b0 * uv[0].v + b1 * uv[1].v + b2 * uv[2].v, height, slot.wrap_t);
    const size_t word = static_cast<size_t>(texture.level_offset[level]) + (y * width + x) * words;
    std::array<double, 3> rgb;
    for (int c = 0; c < 3; ++c) rgb[c] = factor[c] * ChannelOf(scene.textures, texture, word, c);
    sum += Luminance(rgb);
  }
  return sum / (kAcross * kAcross);
}

void WorldVertex(const GeometryTables& g, const Placement& p, uint32_t vertex, float out[3]) {
  const float* const v = g.vertices[static_cast<size_t>(p.first_vertex) + vertex].position;
  if ((p.flags & stages::kPlacementInstanced) == 0) {
    std::copy_n(v, 3, out);
    return;
  }
  for (int r = 0; r < 3; ++r) {
    const float* const m = p.object_to_world + 4 * r;
    out[r] = m[0] * v[0] + m[1] * v[1] + m[2] * v[2] + m[3];
  }
}

TriangleEmission EmissionOf(const SceneTables& scene, int32_t placement, int32_t primitive) {
  const GeometryTables& g = scene.geometry;
  const Placement& p = g.placements[placement];
  const Material& material = scene.materials[p.material];
  const uint32_t* const index = &g.indices[p.first_index + size_t{3} * primitive];
  TriangleEmission e;
  e.placement = placement;
  e.primitive = primitive;
  WorldVertex(g, p, index[0], e.p0);
  WorldVertex(g, p, index[1], e.p1);
  WorldVertex(g, p, index[2], e.p2);
  std::copy_n(material.emissive, 3, e.radiance);
  e.two_sided = (material.flags & stages::kMaterialDoubleSided) != 0;
  const int32_t slot = material.slots[static_cast<int>(stages::Slot::emissive)];
  if (slot == kNone) {
    e.radiance_luminance = static_cast<float>(
        Luminance({material.emissive[0], material.emissive[1], material.emissive[2]}));
  } else {
    e.varies = true;
    const TextureSlot& s = scene.textures.slots[slot];
    const std::array<Uv, 3> corners = {VertexUv(g, p, index[0], s.uv_set),
                                       VertexUv(g, p, index[1], s.uv_set),
                                       VertexUv(g, p, index[2], s.uv_set)};
    e.radiance_luminance = static_cast<float>(MeanTexture(scene, s, corners, material.emissive));
  }
  return e;
}

}  // namespace

std::vector<TriangleEmission> CollectEmission(const SceneTables& scene,
                                              const std::vector<int32_t>& triangles_of_placement) {
  std::vector<TriangleEmission> all;
  for (size_t i = 0; i < scene.geometry.placements.size(); ++i) {
    const Material& material = scene.materials[scene.geometry.placements[i].material];
    const bool emits = (material.flags & stages::kMaterialEmissive) != 0 &&
                       (material.flags & stages::kMaterialUnlit) == 0;
    if (!emits) continue;
    const size_t first = all.size();
    const int32_t count = triangles_of_placement[i];
    all.resize(first + static_cast<size_t>(count));
    tbb::parallel_for(int32_t{0}, count, [&](int32_t k) {
      all[first + static_cast<size_t>(k)] = EmissionOf(scene, static_cast<int32_t>(i), k);
    });
  }
  return all;
}

}  // namespace carpool::render
