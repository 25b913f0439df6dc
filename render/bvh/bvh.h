// Builds Embree's acceleration structures over the placements and keeps them alive.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "render/scene/placement.h"
#include "stages/tables/scene.h"
#include "stages/tracing/trace.h"

namespace carpool::render {

struct BvhOptions {
  std::string isa = "auto";  // "sse4", "avx2", "avx512" or "auto": Embree's own kernels
  bool robust = true;        // Embree's ROBUST flag: watertight along shared edges
};

struct DeviceReleaser {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct SceneReleaser {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using DevicePtr = std::unique_ptr<RTCDeviceTy, DeviceReleaser>;
using ScenePtr = std::unique_ptr<RTCSceneTy, SceneReleaser>;

/// Bvh owns Embree's device and scenes. Borrows the vertex and index streams of the scene it was
/// built over, which must outlive it unchanged. Building uses the threads of the calling arena;
/// queries are thread safe.
class Bvh {
 public:
  Bvh(stages::SceneTables& scene, const PlacementPlan& plan, const BvhOptions& options);
  ~Bvh();
  Bvh(const Bvh&) = delete;
  Bvh& operator=(const Bvh&) = delete;

  stages::TraceView View() const;
  uint64_t bytes() const { return bytes_; }    // what Embree holds now
  double seconds() const { return seconds_; }  // that building took

 private:
  struct Level {
    ScenePtr scene;
    std::vector<ScenePtr> meshes;  // bottom levels of instanced meshes
    std::vector<int32_t> top, nested;
  };

  void BuildLevel(Level& level, const stages::SceneTables& scene, const PlacementPlan& plan,
                  bool transparent, bool robust);
  ScenePtr BuildMesh(const stages::SceneTables& scene, const PlacementPlan::Instanced& instance,
                     bool transparent, bool robust, std::vector<int32_t>& members);
  static bool CountMemory(void* self, ssize_t bytes, bool post);

  const stages::GeometryTables& geometry_;
  std::atomic<uint64_t> bytes_{0};
  double seconds_ = 0;
  DevicePtr device_;
  Level opaque_, transparent_;
};

/// True if shadow rays must ask the material of this placement how much it lets through.
bool IsTransparent(const stages::SceneTables& scene, const stages::Placement& placement);

}  // namespace carpool::render
