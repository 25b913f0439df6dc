// Makes the mip chain of one texture: every level is the box filter of the one above, in linear
// light.
#pragma once

#include <cstdint>
#include <span>

#include "stages/tables/materials.h"

namespace carpool::render {

/// Levels down to 1 x 1, but at most stages::kMaxMips.
int MipLevels(int width, int height);

/// Words that level `level` of `texture` takes.
int64_t LevelWords(const stages::Texture& texture, int level);

/// Fills levels 1 and up from level 0 at `texture.level_offset` of `words`. Odd sizes are weighted
/// by exact coverage (each texel of a level of n covers w / n texels of the one above). Colours of
/// sRGB textures are decoded, averaged and encoded again; with `alpha_weighted` each of them counts
/// by its alpha, unless all alphas are 0. Sums are kept in float down the chain, so that rounding
/// does not add up.
void FillMipLevels(const stages::Texture& texture, bool alpha_weighted, std::span<uint32_t> words);

}  // namespace carpool::render
