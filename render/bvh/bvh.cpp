// Embree scenes over flat and instanced placements, opaque ones apart from those that may let rays
// through.
#include "render/bvh/bvh.h"

#include <atomic>
#include <chrono>
#include <map>
#include <stdexcept>

namespace carpool::render {
namespace {

using stages::Placement;
using stages::SceneTables;
using stages::Shape;

struct GeometryReleaser {
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
using GeometryPtr = std::unique_ptr<RTCGeometryTy, GeometryReleaser>;

std::string DeviceConfig(const std::string& isa) {
  if (isa == "sse4") return "isa=sse4.2";
  if (isa == "avx2" || isa == "avx512") return "isa=" + isa;
  return {};
}

[[noreturn]] void ThrowEmbree(RTCDevice device, const char* doing) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  throw std::runtime_error(std::string("Embree failed while ") + doing + ", error " +
                           std::to_string(static_cast<int>(error)));
}

ScenePtr NewScene(RTCDevice device, bool robust) {
  ScenePtr scene(rtcNewScene(device));
  if (!scene) ThrowEmbree(device, "making a scene");
  // The filter is asked for by the few rays that go on through layers.
  rtcSetSceneFlags(scene.get(), static_cast<RTCSceneFlags>(stages::kFilterPerRay |
                                                           (robust ? RTC_SCENE_FLAG_ROBUST : 0)));
  rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_HIGH);
  return scene;
}

// Buffers are shared: Embree reads the streams in place.
GeometryPtr NewTriangles(RTCDevice device, const SceneTables& scene, const Placement& p,
                         const Shape& shape) {
  GeometryPtr geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
  if (!geometry) ThrowEmbree(device, "making a geometry");
  const stages::GeometryTables& g = scene.geometry;
  rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                             g.vertices.data(),
                             sizeof(stages::MeshVertex) * static_cast<size_t>(p.first_vertex) +
                                 offsetof(stages::MeshVertex, position),
                             sizeof(stages::MeshVertex), static_cast<size_t>(shape.vertex_count));
  rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                             g.indices.data(),
                             sizeof(uint32_t) * static_cast<size_t>(p.first_index),
                             3 * sizeof(uint32_t), static_cast<size_t>(shape.triangle_count));
  rtcCommitGeometry(geometry.get());
  return geometry;
}

using stages::TraceLevel;

}  // namespace

bool IsTransparent(const SceneTables& scene, const Placement& placement) {
  return scene.materials[placement.material].alpha_mode != stages::AlphaMode::opaque;
}

bool Bvh::CountMemory(void* self, ssize_t bytes, bool) {
  static_cast<Bvh*>(self)->bytes_ += static_cast<uint64_t>(bytes);
  return true;
}

Bvh::Bvh(SceneTables& scene, const PlacementPlan& plan, const BvhOptions& options)
    : geometry_(scene.geometry), device_(rtcNewDevice(DeviceConfig(options.isa).c_str())) {
  if (!device_) ThrowEmbree(nullptr, "starting");
  const auto begin = std::chrono::steady_clock::now();
  rtcSetDeviceMemoryMonitorFunction(device_.get(), &CountMemory, this);
  BuildLevel(opaque_, scene, plan, false, options.robust);
  BuildLevel(transparent_, scene, plan, true, options.robust);
  seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

Bvh::~Bvh() {
  // Embree reports what it frees; the counter must still be there.
  opaque_ = {};
  transparent_ = {};
  device_.reset();
}

// Attaches the shapes of one mesh, from the placements that one of its instances has; `members`
// gets the place among them of each Embree geometry.
ScenePtr Bvh::BuildMesh(const SceneTables& scene, const PlacementPlan::Instanced& instance,
                        bool transparent, bool robust, std::vector<int32_t>& members) {
  const stages::Mesh& mesh = scene.geometry.meshes[instance.mesh];
  ScenePtr built;
  for (int32_t s = 0; s < mesh.shape_count; ++s) {
    const Placement& p = scene.geometry.placements[instance.first_placement + s];
    if (IsTransparent(scene, p) != transparent) continue;
    if (!built) built = NewScene(device_.get(), robust);
    rtcAttachGeometry(
        built.get(),
        NewTriangles(device_.get(), scene, p, scene.geometry.shapes[mesh.first_shape + s]).get());
    members.push_back(s);
  }
  if (built) rtcCommitScene(built.get());
  return built;
}

void Bvh::BuildLevel(Level& level, const SceneTables& scene, const PlacementPlan& plan,
                     bool transparent, bool robust) {
  ScenePtr top = NewScene(device_.get(), robust);
  level.top.push_back(stages::kNone);  // of rays that hit nothing
  for (const PlacementPlan::Flat& flat : plan.flat) {
    const Placement& p = scene.geometry.placements[flat.placement];
    if (IsTransparent(scene, p) != transparent) continue;
    const GeometryPtr geometry =
        NewTriangles(device_.get(), scene, p, scene.geometry.shapes[flat.shape]);
    rtcAttachGeometry(top.get(), geometry.get());  // numbers are given in order from 0
    level.top.push_back(flat.placement);
  }

  struct BuiltMesh {
    RTCScene scene = nullptr;
    std::vector<int32_t> members;
  };
  std::map<int32_t, BuiltMesh> built;
  for (const PlacementPlan::Instanced& instance : plan.instanced) {
    const auto [found, is_new] = built.try_emplace(instance.mesh);
    BuiltMesh& mesh = found->second;
    if (is_new) {
      ScenePtr scene_of_mesh = BuildMesh(scene, instance, transparent, robust, mesh.members);
      mesh.scene = scene_of_mesh.get();
      if (scene_of_mesh) level.meshes.push_back(std::move(scene_of_mesh));
    }
    if (mesh.scene == nullptr) continue;
    const GeometryPtr geometry(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE));
    rtcSetGeometryInstancedScene(geometry.get(), mesh.scene);
    rtcSetGeometryTransform(geometry.get(), 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR,
                            scene.geometry.placements[instance.first_placement].object_to_world);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(top.get(), geometry.get());
    level.top.push_back(static_cast<int32_t>(level.nested.size()));
    for (const int32_t member : mesh.members)
      level.nested.push_back(instance.first_placement + member);
  }

  if (level.top.size() == 1) return;
  rtcCommitScene(top.get());
  const RTCError error = rtcGetDeviceError(device_.get());
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  if (error != RTC_ERROR_NONE)
    throw std::runtime_error("Embree failed to build the scene, error " + std::to_string(error));
  level.scene = std::move(top);
}

stages::TraceView Bvh::View() const {
  const auto view = [](const Level& level) {
    return TraceLevel{level.scene.get(), level.top.data() + 1, level.nested.data()};
  };
  return {view(opaque_), view(transparent_), stages::ViewOf(geometry_),
          stages::NativePacketSize(device_.get())};
}

}  // namespace carpool::render
