// Cameras and punctual lights of the drawn nodes.
#pragma once

#include <vector>

#include "render/gltf/document.h"
#include "render/gltf/nodes.h"

namespace carpool::render::gltf {

std::vector<CameraNode> ReadCameras(const Document& document, const NodeTree& tree);
std::vector<PunctualLight> ReadLights(Document& document, const NodeTree& tree);

/// How many lights KHR_lights_punctual lists in the file.
uint64_t CountLights(const Document& document);

}  // namespace carpool::render::gltf
