// Materials and textures as the kernels read them: fixed records and one pool of texel words.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/tables/huge_pages.h"

#include "stages/tables/geometry.h"

namespace carpool::stages {

enum class AlphaMode : int32_t { opaque = 0, mask = 1, blend = 2 };

enum MaterialFlags : int32_t {
  kMaterialDoubleSided = 1,
  kMaterialUnlit = 2,     // KHR_materials_unlit: base colour is the radiance, nothing is reflected
  kMaterialEmissive = 4,  // emissive factor x strength is non-zero
  kMaterialIorZero =
      8,  // KHR_materials_ior ior = 0: Fresnel term is 1 (specular-glossiness fallback)
};

/// A texture as one material slot uses it: 16 words.
struct alignas(64) TextureSlot {
  int32_t texture = kNone;  // into `TextureTables::textures`
  int32_t uv_set = 0;
  int32_t wrap_s = 0;  // WrapMode
  int32_t wrap_t = 0;
  int32_t filter = 0;  // FilterMode
  int32_t has_transform = 0;
  float transform[6] = {
      1, 0, 0, 0, 1, 0};  // KHR_texture_transform: u' = [0]u + [1]v + [2]; v' = [3]u + [4]v + [5]
  int32_t pad[4] = {};
};
static_assert(sizeof(TextureSlot) == 64);

enum WrapMode : int32_t { kWrapRepeat = 0, kWrapClamp = 1, kWrapMirror = 2 };
/// How texels are filtered; minification chooses between mip levels, magnification within level 0.
enum FilterMode : int32_t {
  kFilterMagNearest = 1,  // else linear
  kFilterMinNearest = 2,  // else linear within a level
  kFilterMipNone = 4,     // always level 0
  kFilterMipNearest = 8,  // nearest level; otherwise levels are blended
};

enum class Slot : int32_t {
  base_color,
  metallic_roughness,
  normal,
  emissive,
  specular,
  specular_color,
  count
};
constexpr int kSlotCount = static_cast<int>(Slot::count);

/// One glTF material: 32 words, gathered by field. Colours are linear Rec.709.
struct alignas(128) Material {
  float base_color[4] = {1, 1, 1, 1};
  float emissive[3] = {0, 0, 0};  // factor x KHR_materials_emissive_strength, cd/m2
  float metallic = 1;
  float roughness = 1;
  float normal_scale = 1;
  float alpha_cutoff = 0.5f;
  float ior = 1.5f;
  float specular = 1;  // KHR_materials_specular specularFactor
  float specular_color[3] = {1, 1, 1};
  AlphaMode alpha_mode = AlphaMode::opaque;
  int32_t flags = 0;
  int32_t slots[kSlotCount] = {kNone, kNone, kNone,
                               kNone, kNone, kNone};  // into TextureTables::slots
  int32_t pad[8] = {};
};
static_assert(sizeof(Material) == 128);

enum class TexelFormat : int32_t {
  rgba8 = 0,
  rgba16 = 1
};  // 1 or 2 words a texel, little-endian R first

constexpr int kMaxMips = 16;

/// One image in one colour space, with its mip chain in `TextureTables::words`; level l is
/// max(1, width >> l) x max(1, height >> l), rows from the top (v = 0). 32 words.
struct alignas(128) Texture {
  int32_t width = 1;
  int32_t height = 1;
  int32_t levels = 1;
  TexelFormat format = TexelFormat::rgba8;
  int32_t srgb =
      0;  // 1: RGB is sRGB-encoded and is decoded before filtering; alpha is always linear
  int32_t pad[11] = {};
  int32_t level_offset[kMaxMips] = {};  // word offset of each level, at most 2^31 - 1
};
static_assert(sizeof(Texture) == 128);

struct TextureTables {
  UnsetHugeVector<uint32_t> words;  // all texels of all textures, at most 2^31 - 1 words (8 GiB)
  std::vector<Texture> textures;
  std::vector<TextureSlot> slots;
};

}  // namespace carpool::stages
