// A scene with everything that could make the order of work matter.
#pragma once

#include <filesystem>

#include "tests/support/scene_builder.h"

namespace carpool::test {

/// A room with everything that could make order matter: many materials, transparency, instances,
/// mirrored nodes, point and area lights, and an open side to a sky.
inline std::filesystem::path BusyScene(const std::filesystem::path& folder) {
  SceneBuilder b;
  const int wall = b.AddLambert({0.7, 0.6, 0.5});
  const int lamp = b.AddLambert({0, 0, 0}, {1, 0.9, 0.8}, 8);
  const int veil = b.AddMaterial(
      {{"pbrMetallicRoughness", {{"baseColorFactor", {0.2, 0.5, 0.9, 0.4}}, {"metallicFactor", 0}}},
       {"alphaMode", "BLEND"},
       {"doubleSided", true}});
  b.PlaceMesh(b.AddQuad({-2, -1, 2}, {2, -1, 2}, {2, -1, -2}, {-2, -1, -2}, wall));
  b.PlaceMesh(b.AddQuad({-2, -1, -2}, {2, -1, -2}, {2, 2, -2}, {-2, 2, -2}, wall));
  b.PlaceMesh(
      b.AddQuad({-0.5, 1.9, -0.5}, {0.5, 1.9, -0.5}, {0.5, 1.9, 0.5}, {-0.5, 1.9, 0.5}, lamp));
  b.PlaceMesh(
      b.AddQuad({-1.2, -0.8, 0.6}, {0.2, -0.8, 0.6}, {0.2, 0.6, 0.6}, {-1.2, 0.6, 0.6}, veil));
  for (int i = 0; i < 6; ++i) {
    const int material = b.AddMaterial({{"pbrMetallicRoughness",
                                         {{"baseColorFactor", {0.9, 0.15 * i, 0.3, 1}},
                                          {"metallicFactor", i % 2},
                                          {"roughnessFactor", 0.1 + 0.15 * i}}}});
    const int sphere = b.AddSphere(0.3, 12, material, false);
    b.AddNode({{"mesh", sphere}, {"translation", {-1.5 + 0.6 * i, -0.7, 0.1 * i}}});
    b.AddNode({{"mesh", sphere},
               {"translation", {-1.5 + 0.6 * i, 0.3, -1}},
               {"scale", {-0.7, 1.2, 0.8}}});
  }
  b.json()["extensionsUsed"].push_back("KHR_lights_punctual");
  b.json()["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"intensity", 3}}};
  b.AddNode(
      {{"translation", {1.5, 1, 1}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  b.AddCamera({0, 0.3, 4.5}, 0.7);
  return b.Write(folder, "busy");
}

}  // namespace carpool::test
