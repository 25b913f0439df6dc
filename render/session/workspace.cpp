// Puts a render together: threads, kernels, scene, BVH, film, executor.
#include "render/session/workspace.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

namespace carpool::render {
namespace {

uint64_t MemoryBytes(const RenderSettings& settings, int threads) {
  if (settings.memory_mb > 0) return uint64_t{static_cast<uint32_t>(settings.memory_mb)} << 20;
  return (uint64_t{64} << 20) +
         (uint64_t{4} << 20) * static_cast<uint64_t>(std::max(0, threads - 2));
}

float ClampOf(const RenderSettings& settings) {
  return settings.clamp > 0 ? static_cast<float>(settings.clamp)
                            : std::numeric_limits<float>::infinity();
}

// Half a million events: some 75 MB of JSON.
constexpr size_t kTraceBytes = size_t{16} << 20;

stages::DirectSampling DirectSampling(DirectLight direct) {
  switch (direct) {
    case DirectLight::light:
      return stages::DirectSampling::light;
    case DirectLight::bsdf:
      return stages::DirectSampling::bsdf;
    case DirectLight::mis:
      break;
  }
  return stages::DirectSampling::mis;
}

carpool::Policy SchedulerPolicy(Policy policy) {
  switch (policy) {
    case Policy::fullest:
      return carpool::Policy::fullest_first();
    case Policy::oldest:
      return carpool::Policy::oldest_first();
    case Policy::deepest:
      break;
  }
  return carpool::Policy::deepest_first();
}

}  // namespace

Threads::Threads(int wanted)
    : count_(wanted > 0 ? wanted : tbb::this_task_arena::max_concurrency()),
      limit_(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(count_)),
      arena_(count_) {}

const stages::Kernels& KernelsFor(Isa isa) {
  const stages::Kernels* const kernels = stages::FindKernels(Name(isa));
  if (kernels != nullptr) return *kernels;
  std::string available;
  for (const stages::Kernels& k : stages::AvailableKernels())
    available += (available.empty() ? "" : ", ") + std::string(k.isa);
  throw Error(ExitCode::usage,
              "--isa " + std::string(Name(isa)) + ": this machine has " +
                  (available.empty() ? "none of SSE4.2, AVX2, AVX-512" : available));
}

PreparedScene LoadScene(const RenderSettings& settings, const WarningSink& warn) {
  LoadOptions load;
  load.allow_outside = settings.allow_outside;
  load.scene = settings.scene;
  load.warn = warn;
  AssembleOptions assemble;
  assemble.camera = settings.camera;
  assemble.environment = settings.env_path;
  assemble.width = settings.width;
  assemble.height = settings.height;
  assemble.default_width = kDefaultWidth;
  assemble.warn = warn;
  const auto begin = std::chrono::steady_clock::now();
  ImportedScene imported = LoadGltf(settings.scene_path, load);
  const double import =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  PreparedScene scene = AssembleScene(std::move(imported), assemble);
  scene.times.import = import;
  return scene;
}

stages::KernelContext MakeContext(const PreparedScene& scene, const Plan& plan,
                                  const RenderSettings& settings) {
  stages::KernelContext c;
  c.camera = scene.tables.camera;
  c.geometry = stages::ViewOf(scene.tables.geometry);
  c.materials = scene.tables.materials.data();
  c.textures = stages::ViewOf(scene.tables.textures);
  c.lights = stages::LightViewOf(scene.tables);
  c.bsdf = stages::SharedBsdfTables().View();
  c.first_hits = plan.first_hits();
  c.width = static_cast<uint32_t>(scene.width);
  c.height = static_cast<uint32_t>(scene.height);
  c.seed = settings.seed;
  c.max_depth = static_cast<uint32_t>(settings.max_depth);
  c.roulette_depth = static_cast<uint32_t>(settings.roulette_depth);
  c.direct = DirectSampling(settings.direct);
  if (settings.lights == LightChoice::uniform)
    c.lights.uniform_count = static_cast<int32_t>(scene.tables.lights.lights.size());
  return c;
}

stages::ExecutorOptions ExecutorOptionsFor(const RenderSettings& settings, Threads& threads) {
  stages::ExecutorOptions options;
  options.arena = &threads.arena();
  options.threads = static_cast<uint32_t>(threads.count());
  options.memory_bytes = MemoryBytes(settings, threads.count());
  options.batch_items = static_cast<uint32_t>(settings.batch_items);
  options.policy = SchedulerPolicy(settings.policy);
  return options;
}

Workspace::Workspace(PreparedScene scene, const RenderSettings& settings, Threads& threads)
    : scene_(std::move(scene)),
      plan_(MakePlan(scene_, settings)),
      kernels_(KernelsFor(settings.isa)),
      bvh_(scene_.tables, scene_.placement, {std::string(Name(settings.isa)), settings.robust}),
      film_(static_cast<uint32_t>(scene_.width), static_cast<uint32_t>(scene_.height), plan_.film,
            ClampOf(settings)),
      context_(MakeContext(scene_, plan_, settings)),
      trace_(settings.trace_path.empty() ? Trace(nullptr) : Trace(kTraceBytes)) {
  context_.trace = bvh_.View();
  context_.film = &film_;
  stages::ExecutorOptions options = ExecutorOptionsFor(settings, threads);
  options.trace = trace_;
  executor_ = MakeExecutor(options);
}

std::unique_ptr<stages::Executor> Workspace::MakeExecutor(
    const stages::ExecutorOptions& options) const {
  if (plan_.executor == Executor::reference)
    return stages::MakeReference(context_, kernels_, options);
  std::vector<std::unique_ptr<stages::Executor>> candidates;
  if (plan_.executor != Executor::megakernel) {
    candidates.push_back(
        stages::MakeWavefront(context_, kernels_, scene_.tables.geometry.placements, options));
  }
  if (plan_.executor != Executor::wavefront)
    candidates.push_back(stages::MakeMegakernel(context_, kernels_, options));
  if (candidates.size() == 1) return std::move(candidates.front());
  return stages::MakeFastest(std::move(candidates), uint64_t{context_.width} * context_.height);
}

}  // namespace carpool::render
