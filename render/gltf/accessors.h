// Typed reading of accessors: any component type, normalised, sparse, interleaved or without data.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "render/gltf/document.h"

namespace carpool::render::gltf {

/// Elements that an accessor without a buffer view may have. Nothing in the file backs them, so a
/// short file could ask for any amount; real ones are morph targets, far smaller.
inline constexpr uint64_t kMostImplicitElements = uint64_t{1} << 24;

/// What the JSON says about an accessor, with its extent checked against the buffer.
struct AccessorLayout {
  int index = 0;
  uint64_t count = 0;
  int component_type = 0;  // 5120 .. 5126
  int components = 0;      // 1 .. 16
  bool normalized = false;
  const std::byte* data = nullptr;  // element 0; null: all zeros
  uint64_t stride = 0;              // bytes between elements
  bool sparse = false;
};

AccessorLayout ReadLayout(const Document& document, int accessor);

/// ReadFloats() returns the elements named by `elements` (each below the count), or all of them, as
/// `layout.components` floats each; normalised integers are mapped to [0, 1] or [-1, 1].
std::vector<float> ReadFloats(const Document& document, const AccessorLayout& layout,
                              std::optional<std::span<const uint32_t>> elements = std::nullopt);

/// ReadIndices() returns a SCALAR accessor of unsigned integers.
std::vector<uint32_t> ReadIndices(const Document& document, int accessor);

}  // namespace carpool::render::gltf
