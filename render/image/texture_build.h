// Turns a scene's encoded images into the texture tables that the kernels read.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "render/base/error.h"
#include "stages/tables/materials.h"

namespace carpool::render {

/// A PNG or JPEG file in memory; `where` names it in errors.
struct EncodedImageView {
  std::span<const std::byte> bytes;
  std::string where;
};

/// One texture to be made of one image.
struct TextureSourceView {
  int image = 0;               // into the images
  bool srgb = false;           // RGB is sRGB-encoded
  bool alpha_weighted = true;  // sRGB only: in mip levels a colour counts by its alpha; false where
                               // alpha is something else than coverage
};

/// Makes `out.textures`, one per source in their order, and `out.words` with their mip chains;
/// `out.slots` stays as it is. Images decode in parallel, each once, however many sources use it;
/// equal sources share their texels; images without a source are not looked at. Throws the
/// InputError of the first bad image, and one if the texels need more than 2^31 - 1 words; `out` is
/// then unspecified. `warn` may be called from several threads at once.
void BuildTextures(std::span<const EncodedImageView> images,
                   std::span<const TextureSourceView> sources, stages::TextureTables& out,
                   const WarningSink& warn);

}  // namespace carpool::render
