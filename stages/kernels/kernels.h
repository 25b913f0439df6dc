// The stages' kernels as plain functions over slots of path state: one table per instruction set,
// each function at full SIMD width and at one lane, from the same source.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "stages/film/accumulator.h"
#include "stages/tables/bsdf_tables.h"
#include "stages/tables/camera.h"
#include "stages/tables/camera_rays.h"
#include "stages/tables/geometry_view.h"
#include "stages/tables/light_view.h"
#include "stages/tables/materials.h"
#include "stages/tables/path.h"
#include "stages/tables/texture_view.h"
#include "stages/tracing/trace.h"

namespace carpool::stages {

/// Which samples of direct light count: both strategies, weighted, or one of them alone (delta
/// lights are always sampled as lights).
enum class DirectSampling : uint8_t { mis, light, bsdf };

/// What one vertex of one path did that its state does not keep. One-lane kernels write it where a
/// path is explained.
struct PathProbe {
  int32_t lobe = -1;             // that was sampled, in the order of Bsdf's lobes
  int32_t light = -1;            // that was sampled; -1: the environment, or none
  float light_pdf = 0;           // of the direction that light sampling chose, ...
  float light_bsdf_pdf = 0;      // ... and what BSDF sampling has for it
  float light_weight = 0;        // of that light sample
  float emission_light_pdf = 0;  // what light sampling has for the emission that was hit, ...
  float emission_weight = 0;     // ... and its weight; 0: nothing that emits was hit
};

/// All that kernels read of a render; borrowed, constant while it runs.
struct KernelContext {
  Camera camera;
  GeometryView geometry;
  const Material* materials = nullptr;
  TextureTablesView textures;
  LightView lights;
  BsdfTablesView bsdf;
  TraceView trace;
  FilmAccumulator* film = nullptr;
  bool first_hits = false;  // the film keeps AOVs of the first hit
  uint32_t width = 1, height = 1;
  uint32_t seed = 0;
  uint32_t max_depth = 8;       // scattering events
  uint32_t roulette_depth = 1;  // events before Russian roulette
  DirectSampling direct = DirectSampling::mis;
  PathProbe* probe = nullptr;  // set where one path alone is followed, to explain it
};

/// Where a path goes next.
enum class Next : uint8_t { film, shadow, trace };

using CameraKernel = void (*)(const KernelContext&, CameraRays& rays);

/// One width of the kernels. Those of paths handle `slots` of `paths`; masked lanes touch nothing.
struct KernelSet {
  int lanes = 1;
  /// Makes the rays of the pixels and samples that are set, with no radiance.
  CameraKernel camera;
  /// Sets the radiance of traced camera rays that hit nothing to the environment's.
  void (*background)(const KernelContext&, CameraRays& rays);
  /// Shades surface hits: emission, next-event estimation, BSDF sampling, roulette; or passes
  /// through a transparent layer. Writes the way of each slot to `next`.
  void (*shade)(const KernelContext&, PathState* paths, std::span<const uint32_t> slots,
                Next* next);
  /// Adds the environment to paths that left the scene; they end. One that has only its camera ray
  /// behind it gets what `background` gives, bit for bit.
  void (*miss)(const KernelContext&, PathState* paths, std::span<const uint32_t> slots);
};

/// An instruction set of this binary.
struct Kernels {
  std::string_view isa;  // "sse4", "avx2", "avx512"
  KernelSet wide;
  KernelSet one;
  /// Coverage of a possibly transparent material, for shadow rays. `context` is a KernelContext.
  float (*opacity)(const void* context, int32_t placement, uint32_t primitive, float u, float v);
};

/// The instruction sets that this binary has and this machine can run, best first; never empty on
/// x86-64 with SSE4.2.
std::span<const Kernels> AvailableKernels();

/// `isa` among AvailableKernels(), or the best for "auto"; null if it is not available.
const Kernels* FindKernels(std::string_view isa);

}  // namespace carpool::stages
