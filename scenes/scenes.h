// The scenes that generate-scenes knows.
#pragma once

#include "scenes/gltf_writer.h"

namespace carpool::scenes {

/// Stored in this folder as text.
GltfWriter CornellBox();  // the classic room: Lambertian walls, two blocks, one square lamp
GltfWriter
Furnace();  // a closed room and a ball that all emit 0.5 and reflect half: radiance 1 everywhere
GltfWriter Materials();  // balls from smooth to rough, metal and paint, before a bent backdrop

/// Made on demand; `count` is what the name says.
GltfWriter Instances(int count);  // balls of 7,200 triangles each, placed `count` times
GltfWriter Lights(int count);  // `count` emissive triangles over six decades of power above a plain
GltfWriter Textures(int count);  // `count` balls, each with a material and a picture of its own

}  // namespace carpool::scenes
