// Chooses the camera of a render, frames the scene where it has none, and makes the kernels'
// record.
#pragma once

#include <array>
#include <string>

#include "render/gltf/gltf.h"
#include "stages/tables/camera.h"

namespace carpool::render {

/// The scene's first camera, or the one whose name or index `wanted` says; empty `wanted` and no
/// camera in the scene: one that frames everything, said through `warn`. Throws InputError if
/// `wanted` is not there, listing those that are.
CameraNode ChooseCamera(const ImportedScene& scene, const std::string& wanted,
                        const WarningSink& warn);

/// Image size in pixels: what was asked for, or `default_width` at the camera's aspect ratio (16:9
/// if it has none).
std::array<int, 2> ImageSize(const CameraNode& camera, int width, int height, int default_width);

/// Camera record for an image of that size; axes made orthonormal (glTF ignores a camera's scale),
/// position left to the caller, who makes it the origin.
stages::Camera MakeCamera(const CameraNode& camera, int width, int height);

}  // namespace carpool::render
