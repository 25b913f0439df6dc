// LoadGltf(): the whole import in the order in which one part needs the other.
#include "render/gltf/document.h"
#include "render/gltf/geometry.h"
#include "render/gltf/gltf.h"
#include "render/gltf/info.h"
#include "render/gltf/lights_cameras.h"
#include "render/gltf/materials.h"
#include "render/gltf/nodes.h"
#include "render/gltf/textures.h"

namespace carpool::render {
namespace gltf {
namespace {

void WarnOfMotion(Document& document) {
  if (!document.Items("animations").empty()) {
    document.Warn("animations", "/animations",
                  "animations are not played; the scene is shown as its nodes stand");
  }
}

uint64_t CountDrawn(const stages::GeometryTables& geometry) {
  uint64_t triangles = 0;
  for (const stages::MeshInstance& instance : geometry.instances) {
    const stages::Mesh& mesh = geometry.meshes[instance.mesh];
    for (int s = 0; s < mesh.shape_count; ++s)
      triangles += geometry.shapes[mesh.first_shape + s].triangle_count;
  }
  return triangles;
}

ImportedScene Import(const std::filesystem::path& path, const LoadOptions& options) {
  Document document = OpenDocument(path, options);
  TextureCollector textures(document);
  MaterialTable materials = ReadMaterials(document, textures);
  const NodeTree tree = ReadNodes(document);
  GeometryBuilder geometry(document, materials, textures.slots);
  PlaceMeshes(document, tree, geometry);
  WarnOfMotion(document);

  ImportedScene scene;
  scene.geometry = geometry.Finish();
  scene.cameras = ReadCameras(document, tree);
  scene.lights = ReadLights(document, tree);
  scene.images = LoadImages(document, textures.image_used());
  scene.summary = Summarize(document);
  scene.summary.scene = tree.scene;
  scene.summary.triangles_drawn = CountDrawn(scene.geometry);
  scene.summary.file_bytes = document.budget.read;
  for (const Json& node : document.Items("nodes"))
    scene.node_names.push_back(Get<std::string>(node, "name", ""));
  scene.materials = std::move(materials.materials);
  scene.material_names = std::move(materials.names);
  scene.slots = std::move(textures.slots);
  scene.texture_sources = std::move(textures.sources);
  return scene;
}

}  // namespace
}  // namespace gltf

ImportedScene LoadGltf(const std::filesystem::path& path, const LoadOptions& options) {
  try {
    return gltf::Import(path, options);
  } catch (const nlohmann::json::exception& error) {
    // The schema should leave nothing for this; if it does, the user still gets a line and an exit
    // code.
    throw InputError(path.string(),
                     std::string("unexpected JSON (") + error.what() + "); export the file again");
  } catch (const std::bad_alloc&) {
    throw InputError(path.string(),
                     "not enough memory for this scene; make it smaller or lower the limits");
  } catch (const std::filesystem::filesystem_error& error) {
    throw InputError(path.string(), std::string("cannot be read (") + error.code().message() +
                                        "); check the file");
  }
}

}  // namespace carpool::render
