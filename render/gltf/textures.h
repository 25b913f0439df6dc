// Texture slots of materials: which image, how it wraps and filters, how its coordinates move.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "render/gltf/document.h"

namespace carpool::render::gltf {

/// Collects slots and the textures they need while materials are read.
class TextureCollector {
 public:
  explicit TextureCollector(Document& document)
      : document_(document), image_used_(document.Items("images").size()) {}

  /// AddSlot() reads the textureInfo at `pointer`. `uv_sets` lists the TEXCOORD sets that the
  /// material uses so far; the slot indexes this list; the image of `use` is set here. Returns an
  /// index into `slots`, or kNone where the texture has no image that can be read.
  int AddSlot(const Json& info, TextureSource use, const std::string& pointer,
              std::vector<int>& uv_sets);

  std::vector<stages::TextureSlot> slots;
  std::vector<TextureSource> sources;
  const std::vector<bool>& image_used() const { return image_used_; }

 private:
  int AddSource(const TextureSource& source);

  Document& document_;
  std::vector<bool> image_used_;
  std::map<TextureSource, int> source_of_;
};

}  // namespace carpool::render::gltf
