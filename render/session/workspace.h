// Everything one render holds in memory, put together in order: tables, BVH, film, kernel context,
// executor.
#pragma once

#include <memory>
#include <string>

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "render/bvh/bvh.h"
#include "render/plan/plan.h"
#include "render/scene/assemble.h"
#include "render/session/settings.h"
#include "stages/executors/executor.h"

namespace carpool::render {

/// The threads of one render: an arena of that many, on a machine that may have fewer cores.
class Threads {
 public:
  explicit Threads(int wanted);  // 0: as many as the process may use
  int count() const { return count_; }
  tbb::task_arena& arena() { return arena_; }

 private:
  int count_;
  tbb::global_control limit_;
  tbb::task_arena arena_;
};

/// The kernels that the settings ask for. Throws Error(usage) if this machine or binary does not
/// have them.
const stages::Kernels& KernelsFor(Isa isa);

/// Reads the scene and what surrounds it. Call inside the arena.
PreparedScene LoadScene(const RenderSettings& settings, const WarningSink& warn);

/// What kernels are to read of `scene`; `trace` and `film` may be added later. Borrows all of it.
stages::KernelContext MakeContext(const PreparedScene& scene, const Plan& plan,
                                  const RenderSettings& settings);

/// What executors are told of the machine: threads, memory, batches, policy.
stages::ExecutorOptions ExecutorOptionsFor(const RenderSettings& settings, Threads& threads);

/// Owns what an executor borrows; not movable, since pointers into it are everywhere.
class Workspace {
 public:
  Workspace(PreparedScene scene, const RenderSettings& settings, Threads& threads);
  Workspace(const Workspace&) = delete;
  Workspace& operator=(const Workspace&) = delete;

  const PreparedScene& scene() const { return scene_; }
  const Plan& plan() const { return plan_; }
  const stages::Kernels& kernels() const { return kernels_; }
  const stages::KernelContext& context() const { return context_; }
  const stages::FilmAccumulator& film() const { return film_; }
  stages::Executor& executor() { return *executor_; }
  const Bvh& bvh() const { return bvh_; }
  const Trace& trace() const { return trace_; }

 private:
  std::unique_ptr<stages::Executor> MakeExecutor(const stages::ExecutorOptions& options) const;

  PreparedScene scene_;
  Plan plan_;
  const stages::Kernels& kernels_;
  Bvh bvh_;
  stages::FilmAccumulator film_;
  stages::KernelContext context_;
  Trace trace_;
  std::unique_ptr<stages::Executor> executor_;
};

}  // namespace carpool::render
