// The outer layer of a scene file: a .glb's chunks, or the bare text of a .gltf.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace carpool::render::gltf {

struct Container {
  std::string_view json;
  std::optional<std::span<const std::byte>> binary;  // the BIN chunk, if there is one
};

/// SplitContainer() tells the two formats apart by content, not by file name. The result points
/// into `file`. `name` is for messages.
Container SplitContainer(std::span<const std::byte> file, const std::string& name);

/// CheckNesting() throws InputError where the JSON text is nested deeper than any real scene,
/// before a parser that keeps a stack has seen it.
void CheckNesting(std::string_view json, const std::string& name);

}  // namespace carpool::render::gltf
