// Counts and names of what a file holds, for `carpool info`.
#pragma once

#include "render/gltf/document.h"

namespace carpool::render::gltf {

/// Summarize() counts what the JSON lists. The scene's own fields are filled by the caller.
SceneSummary Summarize(const Document& document);

}  // namespace carpool::render::gltf
