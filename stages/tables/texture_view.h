// The texture tables as raw pointers, which is how kernels take them.
#pragma once

#include <algorithm>
#include <cstdint>

#include "stages/tables/materials.h"
#include "stages/tables/srgb.h"

namespace carpool::stages {

/// Borrows from a `TextureTables` that must outlive it and stay unchanged.
struct TextureTablesView {
  const uint32_t* words = nullptr;
  const Texture* textures = nullptr;
  const TextureSlot* slots = nullptr;
  const float* srgb8 = nullptr;   // 256 entries: linear light of an 8-bit code
  const float* srgb16 = nullptr;  // 65536 entries, or null if no texture is sRGB with 16 bits
};

inline TextureTablesView ViewOf(const TextureTables& tables) {
  const bool wide_srgb =
      std::any_of(tables.textures.begin(), tables.textures.end(), [](const Texture& texture) {
        return texture.srgb != 0 && texture.format == TexelFormat::rgba16;
      });
  return {tables.words.data(), tables.textures.data(), tables.slots.data(), SrgbDecode8().data(),
          wide_srgb ? SrgbDecode16().data() : nullptr};
}

}  // namespace carpool::stages
