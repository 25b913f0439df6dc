// Texture slots: textureInfo, sampler and KHR_texture_transform become one TextureSlot.
#include "render/gltf/textures.h"

#include <algorithm>
#include <cmath>

namespace carpool::render::gltf {
namespace {

int WrapMode(int gl) {
  if (gl == 33071) return stages::kWrapClamp;
  return gl == 33648 ? stages::kWrapMirror : stages::kWrapRepeat;
}

int FilterMode(const Json& sampler) {
  using namespace stages;
  int filter = Get(sampler, "magFilter", 9729) == 9728 ? kFilterMagNearest : 0;
  switch (Get(sampler, "minFilter", 9987)) {
    case 9728:
      return filter | kFilterMinNearest | kFilterMipNone;
    case 9729:
      return filter | kFilterMipNone;
    case 9984:
      return filter | kFilterMinNearest | kFilterMipNearest;
    case 9985:
      return filter | kFilterMipNearest;
    case 9986:
      return filter | kFilterMinNearest;
    default:
      return filter;
  }
}

/// u' = offset + R scale u. The rotation is counter-clockwise as seen in UV space, whose v points
/// down: the GLSL in the extension's text has the sign the other way round from its own example
/// (offset [0, 1], rotation 90 degrees, scale 0.5 uses the lower left quadrant), which is followed
/// here.
void SetTransform(const Json& transform, stages::TextureSlot& slot) {
  const auto offset = Numbers<2>(transform, "offset", {0, 0});
  const auto scale = Numbers<2>(transform, "scale", {1, 1});
  const double angle = Get(transform, "rotation", 0.0);
  const double c = std::cos(angle), s = std::sin(angle);
  const double matrix[6] = {c * scale[0],  s * scale[1], offset[0],
                            -s * scale[0], c * scale[1], offset[1]};
  std::copy(std::begin(matrix), std::end(matrix), slot.transform);
  static constexpr float kNoTransform[6] = {1, 0, 0, 0, 1, 0};
  slot.has_transform =
      std::equal(std::begin(kNoTransform), std::end(kNoTransform), slot.transform) ? 0 : 1;
}

/// The position of `set` in `sets`, appended if it is not there.
int CompactSet(int set, std::vector<int>& sets) {
  const auto found = std::find(sets.begin(), sets.end(), set);
  if (found != sets.end()) return static_cast<int>(found - sets.begin());
  sets.push_back(set);
  return static_cast<int>(sets.size()) - 1;
}

}  // namespace

int TextureCollector::AddSource(const TextureSource& source) {
  const auto [found, is_new] = source_of_.try_emplace(source, static_cast<int>(sources.size()));
  if (is_new) sources.push_back(source);
  image_used_[source.image] = true;
  return found->second;
}

int TextureCollector::AddSlot(const Json& info, TextureSource use, const std::string& pointer,
                              std::vector<int>& uv_sets) {
  const int index = info["index"];
  const Json& texture = document_.Items("textures")[index];
  if (!texture.contains("source")) {
    document_.Warn("texture without source", Pointer("textures", index),
                   "the texture has no image in a supported format; it is left out");
    return stages::kNone;
  }
  stages::TextureSlot slot;
  use.image = texture["source"];
  slot.texture = AddSource(use);
  int set = Get(info, "texCoord", 0);
  if (const Json* transform = Extension(info, "KHR_texture_transform")) {
    SetTransform(*transform, slot);
    set = Get(*transform, "texCoord", set);
    for (float value : slot.transform) {
      if (!std::isfinite(value))
        document_.Fail(pointer, "KHR_texture_transform overflows; use smaller values");
    }
  }
  slot.uv_set = CompactSet(set, uv_sets);
  if (texture.contains("sampler")) {
    const Json& sampler = document_.Items("samplers")[texture["sampler"].get<int>()];
    slot.wrap_s = WrapMode(Get(sampler, "wrapS", 10497));
    slot.wrap_t = WrapMode(Get(sampler, "wrapT", 10497));
    slot.filter = FilterMode(sampler);
  }
  slots.push_back(slot);
  return static_cast<int>(slots.size()) - 1;
}

}  // namespace carpool::render::gltf
