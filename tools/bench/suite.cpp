// The fixed set: closed and open, plain and textured, few and many triangles, lights, materials.
#include "tools/bench/suite.h"

namespace carpool::tools {

std::vector<SceneCase> SuiteCases(const std::string& own, const std::string& models,
                                  const std::string& generated) {
  const std::string sun = models + "/env/qwantani_afternoon_puresky_1k.hdr";
  const std::string garden = models + "/env/chinese_garden_1k.hdr";
  const auto model = [&](const std::string& name) { return models + "/" + name + "/" + name; };
  return {
      {"Cornell box", own + "/cornell_box.gltf", "", ""},
      {"Sponza, camera 0", model("Sponza") + ".gltf", sun, "0"},
      {"Sponza, camera 1", model("Sponza") + ".gltf", sun, "1"},
      {"FlightHelmet", model("FlightHelmet") + ".gltf", sun, ""},
      {"GasStation", model("GasStation") + ".gltf", "", ""},
      {"SheenChair", model("SheenChair") + ".gltf", garden, ""},
      {"MetalRoughSpheres", model("MetalRoughSpheresNoTextures") + ".glb", garden, ""},
      {"20 M instanced triangles", generated + "/instances.glb", garden, ""},
      {"100,000 lights", generated + "/lights.glb", "", ""},
      {"64 textured materials", generated + "/textures.glb", garden, ""},
  };
}

}  // namespace carpool::tools
