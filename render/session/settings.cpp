// Names, ranges and contradictions of the render settings.
#include "render/session/settings.h"

#include <array>
#include <cmath>
#include <utility>

#include "render/base/error.h"

namespace carpool::render {
namespace {

template <class T, std::size_t N>
using NameTable = std::array<std::pair<std::string_view, T>, N>;

constexpr NameTable<Executor, 4> kExecutors{{{"auto", Executor::automatic},
                                             {"wavefront", Executor::wavefront},
                                             {"megakernel", Executor::megakernel},
                                             {"reference", Executor::reference}}};
constexpr NameTable<Policy, 3> kPolicies{
    {{"deepest", Policy::deepest}, {"fullest", Policy::fullest}, {"oldest", Policy::oldest}}};
constexpr NameTable<Isa, 4> kIsas{
    {{"auto", Isa::automatic}, {"sse4", Isa::sse4}, {"avx2", Isa::avx2}, {"avx512", Isa::avx512}}};
constexpr NameTable<DirectLight, 3> kDirectLights{
    {{"mis", DirectLight::mis}, {"light", DirectLight::light}, {"bsdf", DirectLight::bsdf}}};
constexpr NameTable<LightChoice, 2> kLightChoices{
    {{"tree", LightChoice::tree}, {"uniform", LightChoice::uniform}}};
constexpr NameTable<Aov, 7> kAovs{{{"albedo", Aov::albedo},
                                   {"normal", Aov::normal},
                                   {"depth", Aov::depth},
                                   {"stderr", Aov::standard_error},
                                   {"count", Aov::count},
                                   {"object", Aov::object},
                                   {"material", Aov::material}}};

[[noreturn]] void Refuse(const std::string& line) {
  throw Error(ExitCode::usage, line);
}

template <class T, std::size_t N>
std::string_view NameIn(const NameTable<T, N>& table, T value) {
  for (const auto& [name, entry] : table) {
    if (entry == value) return name;
  }
  return "unknown";
}

template <class T, std::size_t N>
T Lookup(const NameTable<T, N>& table, std::string_view flag, std::string_view name) {
  std::string known;
  for (const auto& [candidate, value] : table) {
    if (candidate == name) return value;
    known += (known.empty() ? "" : ", ") + std::string(candidate);
  }
  Refuse(std::string(flag) + ": '" + std::string(name) + "' is unknown; use one of " + known);
}

void CheckRange(std::string_view flag, double value, double low, double high) {
  if (value >= low && value <= high) return;  // false for NaN too
  const auto text = [](double number) {
    std::string digits = std::to_string(number);
    digits.erase(digits.find_last_not_of('0') + 1);
    if (digits.back() == '.') digits.pop_back();
    return digits;
  };
  Refuse(std::string(flag) + ": " + text(value) + " is out of range; use " + text(low) + " to " +
         text(high));
}

bool EndsWith(std::string_view text, std::string_view ending) {
  return text.size() > ending.size() && text.substr(text.size() - ending.size()) == ending;
}

void CheckSize(const RenderSettings& s) {
  if (s.width == 0 && s.height == 0) return;
  CheckRange("--size", s.width, 1, kMaxSide);
  CheckRange("--size", s.height, 1, kMaxSide);
  if (std::int64_t{s.width} * s.height > kMaxPixels) {
    Refuse("--size: more than " + std::to_string(kMaxPixels) + " pixels; render a smaller image");
  }
}

void CheckPaths(const RenderSettings& s) {
  if (s.scene_path.empty()) Refuse("no scene given; name a .gltf or .glb file");
  if (!s.output_path.empty() && !EndsWith(s.output_path, ".exr")) {
    Refuse("--output: '" + s.output_path + "' must end in .exr");
  }
  if (!s.preview_path.empty() && !EndsWith(s.preview_path, ".png")) {
    Refuse("--preview: '" + s.preview_path + "' must end in .png");
  }
  if (!s.trace_path.empty() &&
      (s.executor == Executor::megakernel || s.executor == Executor::reference)) {
    Refuse("--trace: the " + std::string(Name(s.executor)) +
           " has no stages to show; use --executor wavefront");
  }
}

}  // namespace

void CheckSettings(const RenderSettings& s) {
  CheckPaths(s);
  CheckSize(s);
  CheckRange("--samples", s.samples, 1, kMaxSamples);
  CheckRange("--time", s.time_seconds, 0, 1e9);
  CheckRange("--noise", s.noise_target, 0, 1);
  CheckRange("--depth", s.max_depth, 0, kMaxDepth);
  CheckRange("--roulette", s.roulette_depth, 0, kMaxDepth);
  CheckRange("--clamp", s.clamp, 0, 1e9);
  CheckRange("--exposure", s.exposure, -64, 64);
  CheckRange("--threads", s.threads, 0, kMaxThreads);
  CheckRange("--memory", s.memory_mb, 0, 1 << 20);
  if (s.batch_items != 0) CheckRange("--batch", s.batch_items, kMinBatchItems, kMaxBatchItems);
}

std::string PngPath(std::string_view output_path) {
  if (EndsWith(output_path, ".exr")) output_path.remove_suffix(4);
  return std::string(output_path) + ".png";
}

std::string_view Name(Executor executor) {
  return NameIn(kExecutors, executor);
}
std::string_view Name(Policy policy) {
  return NameIn(kPolicies, policy);
}
std::string_view Name(Isa isa) {
  return NameIn(kIsas, isa);
}
std::string_view Name(DirectLight direct) {
  return NameIn(kDirectLights, direct);
}
std::string_view Name(LightChoice lights) {
  return NameIn(kLightChoices, lights);
}
std::string_view Name(Aov aov) {
  return NameIn(kAovs, aov);
}

Executor ParseExecutor(std::string_view name) {
  return Lookup(kExecutors, "--executor", name);
}
Policy ParsePolicy(std::string_view name) {
  return Lookup(kPolicies, "--policy", name);
}
Isa ParseIsa(std::string_view name) {
  return Lookup(kIsas, "--isa", name);
}

DirectLight ParseDirectLight(std::string_view name) {
  return Lookup(kDirectLights, "--direct", name);
}

LightChoice ParseLightChoice(std::string_view name) {
  return Lookup(kLightChoices, "--lights", name);
}

AovSet ParseAovs(std::string_view list) {
  AovSet set;
  if (list == "all") {
    for (const auto& [name, aov] : kAovs) set = set.With(aov);
    return set;
  }
  while (!list.empty()) {
    const std::size_t comma = list.find(',');
    set = set.With(Lookup(kAovs, "--aov", list.substr(0, comma)));
    list = comma == std::string_view::npos ? "" : list.substr(comma + 1);
  }
  return set;
}

}  // namespace carpool::render
