// Ranges, names and refusals of the render settings.
#include "render/session/settings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "render/base/error.h"

namespace carpool::render {
namespace {

using Change = std::function<void(RenderSettings&)>;

RenderSettings Valid() {
  return {.scene_path = "a.glb", .output_path = "a.exr"};
}

/// The line that `action` is refused with; "" if it is not refused as a usage error.
std::string RefusalOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.code() == ExitCode::usage ? error.what() : "";
  }
  return "";
}

std::string RefusalOf(const Change& change) {
  RenderSettings settings = Valid();
  change(settings);
  return RefusalOf([&settings] { CheckSettings(settings); });
}

TEST(Settings, DefaultsAreValid) {
  EXPECT_NO_THROW(CheckSettings(Valid()));
}

TEST(Settings, EachValueOutOfRangeIsRefusedByItsFlag) {
  const std::pair<std::string, Change> cases[] = {
      {"--samples", [](auto& s) { s.samples = 0; }},
      {"--samples", [](auto& s) { s.samples = kMaxSamples + 1; }},
      {"--time", [](auto& s) { s.time_seconds = -1; }},
      {"--time", [](auto& s) { s.time_seconds = NAN; }},
      {"--noise", [](auto& s) { s.noise_target = 1.5; }},
      {"--depth", [](auto& s) { s.max_depth = -1; }},
      {"--depth", [](auto& s) { s.max_depth = kMaxDepth + 1; }},
      {"--exposure", [](auto& s) { s.exposure = INFINITY; }},
      {"--threads", [](auto& s) { s.threads = kMaxThreads + 1; }},
      {"--memory", [](auto& s) { s.memory_mb = -1; }},
      {"--batch", [](auto& s) { s.batch_items = kMinBatchItems - 1; }},
      {"--size", [](auto& s) { s.width = 16; }},  // and no height
      {"--size", [](auto& s) { s.width = s.height = kMaxSide + 1; }},
      {"--size", [](auto& s) { s.width = s.height = kMaxSide; }},  // too many pixels
      {"--output", [](auto& s) { s.output_path = "a.png"; }},
      {"--output", [](auto& s) { s.output_path = ".exr"; }},
      {"--preview", [](auto& s) { s.preview_path = "a.jpg"; }},
      {"--trace", [](auto& s) { s.trace_path = "t.json", s.executor = Executor::megakernel; }},
      {"--trace", [](auto& s) { s.trace_path = "t.json", s.executor = Executor::reference; }},
      {"no scene", [](auto& s) { s.scene_path = ""; }},
  };
  for (const auto& [flag, change] : cases) {
    EXPECT_EQ(RefusalOf(change).rfind(flag, 0), 0u) << flag << ": '" << RefusalOf(change) << "'";
  }
}

TEST(Settings, LimitsThemselvesAreValid) {
  RenderSettings s = Valid();
  s.samples = kMaxSamples, s.max_depth = kMaxDepth, s.threads = kMaxThreads;
  s.batch_items = kMaxBatchItems, s.exposure = -64, s.noise_target = 1;
  s.width = kMaxSide, s.height = int(kMaxPixels / kMaxSide);
  EXPECT_NO_THROW(CheckSettings(s));
  s.samples = 1, s.max_depth = 0, s.batch_items = kMinBatchItems, s.width = s.height = 1;
  EXPECT_NO_THROW(CheckSettings(s));
}

TEST(Settings, NamesAreReadBack) {
  for (const auto e :
       {Executor::automatic, Executor::wavefront, Executor::megakernel, Executor::reference}) {
    EXPECT_EQ(ParseExecutor(Name(e)), e);
  }
  for (const auto p : {Policy::deepest, Policy::fullest, Policy::oldest}) {
    EXPECT_EQ(ParsePolicy(Name(p)), p);
  }
  for (const auto i : {Isa::automatic, Isa::sse4, Isa::avx2, Isa::avx512}) {
    EXPECT_EQ(ParseIsa(Name(i)), i);
  }
}

TEST(Settings, UnknownNamesAreRefusedWithTheKnownOnes) {
  EXPECT_EQ(RefusalOf([] { ParseExecutor("gpu"); }),
            "--executor: 'gpu' is unknown; use one of auto, wavefront, megakernel, reference");
  EXPECT_NE(RefusalOf([] { ParsePolicy(""); }).find("deepest, fullest, oldest"), std::string::npos);
  EXPECT_NE(RefusalOf([] { ParseIsa("AVX2"); }).find("sse4"), std::string::npos);
}

TEST(Settings, AovsAreAList) {
  EXPECT_EQ(ParseAovs(""), AovSet());
  EXPECT_EQ(ParseAovs("normal,stderr"), AovSet().With(Aov::standard_error).With(Aov::normal));
  const AovSet all = ParseAovs("all");
  for (const auto aov : {Aov::albedo, Aov::normal, Aov::depth, Aov::standard_error, Aov::count,
                         Aov::object, Aov::material}) {
    EXPECT_TRUE(all.Has(aov)) << Name(aov);
    EXPECT_EQ(ParseAovs(Name(aov)), AovSet().With(aov));
  }
  EXPECT_NE(RefusalOf([] { ParseAovs("albedo,,normal"); }), "");
  EXPECT_NE(RefusalOf([] { ParseAovs("albedo normal"); }), "");
}

TEST(Settings, PngStandsBesideTheImage) {
  EXPECT_EQ(PngPath("a/b.c.exr"), "a/b.c.png");
}

}  // namespace
}  // namespace carpool::render
