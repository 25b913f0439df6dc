// What one render is asked to do: every knob of the command line as a plain value, with unit, range
// and default.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace carpool::render {

/// Who drives the kernels. The image of wavefront and megakernel is the same bytes; `automatic`
/// takes the faster for the scene. `reference` renders in double and compares float with it.
enum class Executor { automatic, wavefront, megakernel, reference };

/// Which batch the scheduler takes next among the full ones.
enum class Policy { deepest, fullest, oldest };

/// The instruction set of the kernels and of Embree; `automatic` is the best the machine has.
enum class Isa { automatic, sse4, avx2, avx512 };

/// How light that reaches a surface directly is found. The expectation of the image is the same: a
/// difference beyond noise is a fault, which is what the other two are for.
enum class DirectLight {
  mis,    // light and BSDF sampling, weighted by the power heuristic (Veach and Guibas 1995)
  light,  // light sampling alone
  bsdf,   // BSDF sampling alone; punctual lights, which it cannot hit, are sampled still
};

/// Which light a vertex samples. As with DirectLight, only the noise differs: the second shows what
/// the first is worth.
enum class LightChoice {
  tree,     // by a bound on what each would give the vertex (Conty Estevez and Kulla 2018)
  uniform,  // any, all alike
};

/// Image layers beside the beauty.
enum class Aov : std::uint32_t {
  albedo = 1u << 0,
  normal = 1u << 1,
  depth = 1u << 2,
  standard_error = 1u << 3,  // "stderr" on the command line
  count = 1u << 4,           // samples per pixel
  object = 1u << 5,
  material = 1u << 6,
};

/// A set of layers, e.g. AovSet().With(Aov::albedo).With(Aov::normal).
struct AovSet {
  std::uint32_t bits = 0;

  bool Has(Aov aov) const { return (bits & static_cast<std::uint32_t>(aov)) != 0; }
  AovSet With(Aov aov) const { return {bits | static_cast<std::uint32_t>(aov)}; }
  bool operator==(const AovSet&) const = default;
};

/// Limits that CheckSettings() holds the numbers to.
inline constexpr int kMaxSide = 65'536;                // pixels along one side of the image
inline constexpr std::int64_t kMaxPixels = 1ll << 28;  // pixels in one image
inline constexpr int kMaxSamples = 1 << 20;            // samples per pixel
inline constexpr int kMaxDepth = 256;                  // scattering vertices of a path
inline constexpr int kRouletteDepth = 1;               // default of RenderSettings::roulette_depth
inline constexpr int kMaxThreads = 4096;
inline constexpr int kMinBatchItems = 8, kMaxBatchItems = 65'536;
inline constexpr int kDefaultWidth = 1280;  // pixels, where no size is asked for
inline constexpr int kDefaultSamples = 256;

/// Settings of one render. A field left alone means what its comment calls the default; an
/// aggregate, so a test writes RenderSettings{.scene_path = "box.glb", .samples = 16}.
struct RenderSettings {
  // What is rendered.

  std::string scene_path = {};  ///< .gltf or .glb; required
  std::string scene = {};       ///< name or index of the glTF scene; empty: the default scene
  /// Name or index of the camera; empty: the scene's first, or one that frames the scene.
  std::string camera = {};
  /// Lat-long .exr or .hdr; empty: the scene's own light alone, or a neutral sky if it has none.
  std::string env_path = {};
  bool allow_outside = false;  ///< may URIs leave the scene's folder?

  // The image.

  std::string output_path = {};  ///< .exr; required by Render()
  /// A .png refreshed while rendering, at first from an interleaved subset of pixels; empty: none.
  std::string preview_path = {};
  bool write_png = true;  ///< also write PngPath(output_path), tone-mapped
  float exposure = 0;     ///< EV, -64..64; multiplies the PNGs by 2^exposure, never the EXR
  /// Pixels, 1..kMaxSide each. Both 0: kDefaultWidth wide at the camera's aspect, or 16:9.
  int width = 0, height = 0;
  AovSet aovs = {};  ///< layers beside the beauty; default none

  // How long.

  int samples = kDefaultSamples;  ///< samples per pixel at most, 1..kMaxSamples
  double time_seconds = 0;        ///< stop rendering after this many seconds; 0: no limit
  double noise_target = 0;        ///< stop below this relative standard error, 0..1; 0: no target
  /// Scattering vertices of a path at most, 0..kMaxDepth: 0 shows emission alone, 1 adds direct
  /// light, 2 one bounce between surfaces.
  int max_depth = 8;
  /// Vertices before Russian roulette may end dark paths, 0..kMaxDepth; it does so without bias.
  int roulette_depth = kRouletteDepth;
  DirectLight direct = DirectLight::mis;
  LightChoice lights = LightChoice::tree;
  /// The brightest channel a sample may have, in the image's unit; brighter ones are scaled down,
  /// which is a bias that the summary states. 0: no clamp.
  double clamp = 0;
  std::uint32_t seed = 0;  ///< another seed, another noise

  // The machine. None of these changes the image, except `isa` and `robust` in its last bits.

  int threads = 0;      ///< at most kMaxThreads; 0: as many as the process may use
  int memory_mb = 0;    ///< MiB for path state and queues; 0: 64, more above 2 threads
  int batch_items = 0;  ///< items per batch, kMinBatchItems..kMaxBatchItems; 0: each stage's own
  Executor executor = Executor::automatic;
  Policy policy = Policy::deepest;
  Isa isa = Isa::automatic;
  bool robust = true;  ///< Embree's ROBUST flag: no ray slips between triangles; 5-35 % slower

  // What is said.

  bool quiet = false;           ///< errors only: neither progress nor warnings
  std::string stats_path = {};  ///< the run's report as JSON; empty: none
  /// When each worker did what, for ui.perfetto.dev; empty: none. Not for the megakernel, which has
  /// no stages.
  std::string trace_path = {};
};

/// CheckSettings throws Error(ExitCode::usage), one line naming the flag, if a value is out of its
/// range or two contradict each other.
void CheckSettings(const RenderSettings& settings);

/// PngPath is where the PNG beside `output_path` goes: "a/b.exr" gives "a/b.png".
std::string PngPath(std::string_view output_path);

// The names used on the command line and in image headers.
std::string_view Name(Executor executor);
std::string_view Name(Policy policy);
std::string_view Name(Isa isa);
std::string_view Name(DirectLight direct);
std::string_view Name(LightChoice lights);
std::string_view Name(Aov aov);

// The reverse; each throws Error(ExitCode::usage) that lists the names it knows.
Executor ParseExecutor(std::string_view name);
Policy ParsePolicy(std::string_view name);
Isa ParseIsa(std::string_view name);
DirectLight ParseDirectLight(std::string_view name);
LightChoice ParseLightChoice(std::string_view name);
AovSet ParseAovs(std::string_view comma_separated);  // "albedo,normal", or "all"

}  // namespace carpool::render
