// The executors that lead up to the wavefront: each changes one thing about the one before.
#pragma once

#include <memory>

#include "stages/executors/executor.h"

namespace carpool::stages {

/// What one piece of parallel work is. Pixels come in the groups of 4x2 that camera packets are
/// made of.
enum class Grain { serial, pixel, path };

/// Recursion from vertex to vertex, one lane at a time. All of these borrow `context` and
/// `kernels`, which must outlive the executor.
std::unique_ptr<Executor> MakeRecursive(const KernelContext& context, const Kernels& kernels,
                                        const ExecutorOptions& options, Grain grain);

/// Arrays of paths that all take the same step, then wait for each other: the wavefront as loops
/// over arrays, one lane at a time, compacted after every step.
std::unique_ptr<Executor> MakeBarriers(const KernelContext& context, const Kernels& kernels,
                                       const ExecutorOptions& options);

}  // namespace carpool::stages
