// Reads alpha of factors, finest texture levels and vertex colours.
#include "render/scene/opacity.h"

#include <algorithm>

namespace carpool::render {
namespace {

using stages::AlphaMode;
using stages::Material;
using stages::Texture;

/// Smallest alpha of the finest level, 0..1; filtering never goes below it.
float LeastAlpha(const stages::TextureTables& tables, const Texture& texture) {
  const size_t count =
      size_t{static_cast<uint32_t>(texture.width)} * static_cast<uint32_t>(texture.height);
  const uint32_t* const words = &tables.words[texture.level_offset[0]];
  uint32_t least = 0xffff;
  if (texture.format == stages::TexelFormat::rgba16) {
    for (size_t i = 0; i < count; ++i) least = std::min(least, words[2 * i + 1] >> 16);
    return static_cast<float>(least) / 65535.0f;
  }
  for (size_t i = 0; i < count; ++i) least = std::min(least, words[i] >> 24);
  return static_cast<float>(least) / 255.0f;
}

bool HasTranslucentVertices(const stages::GeometryTables& g, int32_t material) {
  for (const stages::Shape& shape : g.shapes) {
    if (shape.material != material || shape.colors == stages::kNone) continue;
    for (int32_t v = 0; v < shape.vertex_count; ++v) {
      if (g.floats[shape.colors + size_t{4} * v + 3] < 1) return true;
    }
  }
  return false;
}

}  // namespace

void SimplifyOpacity(std::vector<Material>& materials, const stages::TextureTables& textures,
                     const stages::GeometryTables& geometry) {
  std::vector<float> least(textures.textures.size(), -1);
  for (size_t i = 0; i < materials.size(); ++i) {
    Material& m = materials[i];
    if (m.alpha_mode == AlphaMode::opaque) continue;
    float alpha = m.base_color[3];
    const int32_t slot = m.slots[static_cast<int>(stages::Slot::base_color)];
    if (slot != stages::kNone) {
      const int32_t texture = textures.slots[slot].texture;
      if (least[texture] < 0) least[texture] = LeastAlpha(textures, textures.textures[texture]);
      alpha *= least[texture];
    }
    const bool full = m.alpha_mode == AlphaMode::mask ? alpha >= m.alpha_cutoff : alpha >= 1;
    if (full && !HasTranslucentVertices(geometry, static_cast<int32_t>(i)))
      m.alpha_mode = AlphaMode::opaque;
  }
}

}  // namespace carpool::render
