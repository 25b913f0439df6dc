// The texture kernel: against a reference in double, its edge positions, its safety and its bits,
// on every SIMD target of the machine.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "tests/stages/texture_reference.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/stages/texture_test.cpp"
#include "hwy/foreach_target.h"

#include "stages/kernels/texture-inl.h"

#ifndef CARPOOL_TESTS_STAGES_TEXTURE_TEST_ONCE_
#define CARPOOL_TESTS_STAGES_TEXTURE_TEST_ONCE_
namespace carpool::stages {
/// What the kernel made of one query.
struct TextureResult {
  float rgba[4];
};
}  // namespace carpool::stages
#endif

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

template <class D>
void RunQueries(D d, const TextureTablesView& view, const std::vector<TextureQuery>& queries,
                std::vector<TextureResult>& results) {
  const IntTag<D> di;
  constexpr size_t kMax = hn::MaxLanes(D());
  HWY_ALIGN int32_t slot[kMax];
  HWY_ALIGN float u[kMax], v[kMax], footprint[kMax], chance[kMax], out[4][kMax];
  const size_t lanes = hn::Lanes(d);
  for (size_t begin = 0; begin < queries.size(); begin += lanes) {
    const size_t count = std::min(lanes, queries.size() - begin);
    for (size_t i = 0; i < lanes; ++i) {
      // Inactive lanes hold what the contract allows them to: anything.
      constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
      const TextureQuery query =
          i < count ? queries[begin + i] : TextureQuery{0x5000001, kNan, -3e38f, 3e38f, -1e30f};
      slot[i] = query.slot;
      u[i] = query.u;
      v[i] = query.v;
      footprint[i] = query.log2_footprint;
      chance[i] = query.u_level;
    }
    const Rgba<D> rgba = SampleTexture(d, view, hn::Load(di, slot), hn::FirstN(d, count),
                                       Vec2<D>{hn::Load(d, u), hn::Load(d, v)},
                                       hn::Load(d, footprint), hn::Load(d, chance));
    hn::Store(rgba.rgb.x, d, out[0]);
    hn::Store(rgba.rgb.y, d, out[1]);
    hn::Store(rgba.rgb.z, d, out[2]);
    hn::Store(rgba.a, d, out[3]);
    for (size_t i = 0; i < count; ++i) {
      results[begin + i] = {{out[0][i], out[1][i], out[2][i], out[3][i]}};
    }
  }
}

std::vector<TextureResult> RunWide(const TextureTablesView& view,
                                   const std::vector<TextureQuery>& queries) {
  std::vector<TextureResult> results(queries.size());
  RunQueries(hn::ScalableTag<float>(), view, queries, results);
  return results;
}
std::vector<TextureResult> RunOneLane(const TextureTablesView& view,
                                      const std::vector<TextureQuery>& queries) {
  std::vector<TextureResult> results(queries.size());
  RunQueries(hn::CappedTag<float, 1>(), view, queries, results);
  return results;
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carpool::stages {
namespace {

HWY_EXPORT(RunWide);
HWY_EXPORT(RunOneLane);

/// Runs `check(results of all lanes, results of one lane)` on every target that this machine has.
template <class Check>
void OnEveryTarget(const TextureTables& tables, const std::vector<TextureQuery>& queries,
                   const Check& check) {
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    const TextureTablesView view = ViewOf(tables);
    check(HWY_DYNAMIC_DISPATCH(RunWide)(view, queries),
          HWY_DYNAMIC_DISPATCH(RunOneLane)(view, queries));
    hwy::SetSupportedTargetsForTest(0);
  }
}

class Random {
 public:
  explicit Random(uint32_t seed) : engine_(seed) {}
  float Uniform(float low, float high) {
    return low + (high - low) * (static_cast<float>(engine_() >> 8) * 0x1p-24f);
  }
  uint32_t Bits() { return engine_(); }
  int Below(int n) { return static_cast<int>(engine_() % static_cast<uint32_t>(n)); }

 private:
  std::mt19937 engine_;
};

/// Adds a texture whose every word, on every level, is `word()`.
template <class Word>
int AddTexture(TextureTables& tables, int width, int height, TexelFormat format, bool srgb,
               const Word& word) {
  Texture texture;
  texture.width = width;
  texture.height = height;
  texture.format = format;
  texture.srgb = srgb ? 1 : 0;
  texture.levels = static_cast<int>(std::bit_width(static_cast<uint32_t>(std::max(width, height))));
  // A level that does not exist is far outside the pool: reading it, even in an idle lane, crashes.
  std::fill(std::begin(texture.level_offset), std::end(texture.level_offset), 0x40000000);
  for (int level = 0; level < texture.levels; ++level) {
    texture.level_offset[level] = static_cast<int32_t>(tables.words.size());
    const int texels = std::max(1, width >> level) * std::max(1, height >> level);
    for (int i = 0; i < texels * (format == TexelFormat::rgba16 ? 2 : 1); ++i) {
      tables.words.push_back(word());
    }
  }
  tables.textures.push_back(texture);
  return static_cast<int>(tables.textures.size()) - 1;
}

int AddSlot(TextureTables& tables, int texture, int wrap_s, int wrap_t, int filter) {
  TextureSlot slot;
  slot.texture = texture;
  slot.wrap_s = wrap_s;
  slot.wrap_t = wrap_t;
  slot.filter = filter;
  tables.slots.push_back(slot);
  return static_cast<int>(tables.slots.size()) - 1;
}

constexpr int kSizes[][2] = {{1, 1}, {1, 5}, {2, 2}, {3, 7}, {5, 4}, {16, 16}, {17, 31}, {64, 1}};

/// Textures of all formats and sizes, used in all wrap and filter modes, half of them transformed.
TextureTables AllModes(Random& random) {
  TextureTables tables;
  for (const auto& [width, height] : kSizes) {
    for (const TexelFormat format : {TexelFormat::rgba8, TexelFormat::rgba16}) {
      for (const bool srgb : {false, true}) {
        AddTexture(tables, width, height, format, srgb, [&] { return random.Bits(); });
      }
    }
  }
  for (int texture = 0; texture < static_cast<int>(tables.textures.size()); ++texture) {
    for (int mode = 0; mode < 3 * 3 * 16 * 2; ++mode) {
      AddSlot(tables, texture, mode % 3, mode / 3 % 3, mode / 9 % 16);
      if (mode < 3 * 3 * 16) continue;
      tables.slots.back().has_transform = 1;
      for (float& entry : tables.slots.back().transform) entry = random.Uniform(-2, 2);
    }
  }
  return tables;
}

TextureQuery RandomQuery(Random& random, int slot) {
  return {slot, random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(-8, 2),
          random.Uniform(0, 1)};
}

/// A run of equal slots per slot, then slots in random order: both paths of the kernel's loads.
std::vector<TextureQuery> QueriesOfAllSlots(const TextureTables& tables, Random& random) {
  const int slots = static_cast<int>(tables.slots.size());
  std::vector<TextureQuery> queries;
  for (int slot = 0; slot < slots; ++slot) {
    for (int i = 0; i < 16; ++i) queries.push_back(RandomQuery(random, slot));
  }
  for (int i = 0; i < 8 * slots; ++i) queries.push_back(RandomQuery(random, random.Below(slots)));
  return queries;
}

TEST(Texture, AgreesWithTheReferenceInEveryModeFormatAndSize) {
  Random random(1);
  const TextureTables tables = AllModes(random);
  const std::vector<TextureQuery> queries = QueriesOfAllSlots(tables, random);
  std::vector<ReferenceSample> references;
  for (const TextureQuery& query : queries) references.push_back(SampleReference(tables, query));
  OnEveryTarget(tables, queries, [&](const auto& wide, const auto&) {
    size_t compared = 0;
    for (size_t i = 0; i < queries.size(); ++i) {
      if (references[i].margin < 1e-3) continue;
      ++compared;
      for (int channel = 0; channel < 4; ++channel) {
        ASSERT_NEAR(wide[i].rgba[channel], references[i].rgba[channel], 2e-4)
            << "query " << i << " slot " << queries[i].slot << " channel " << channel;
      }
    }
    EXPECT_GT(compared, queries.size() * 95 / 100);
  });
}

TEST(Texture, OneLaneGivesTheBitsOfAllLanes) {
  Random random(2);
  const TextureTables tables = AllModes(random);
  std::vector<TextureQuery> queries = QueriesOfAllSlots(tables, random);
  queries.resize(queries.size() - 3);  // the last vector is partly filled
  OnEveryTarget(tables, queries, [&](const auto& wide, const auto& one) {
    for (size_t i = 0; i < queries.size(); ++i) {
      for (int channel = 0; channel < 4; ++channel) {
        ASSERT_EQ(std::bit_cast<uint32_t>(wide[i].rgba[channel]),
                  std::bit_cast<uint32_t>(one[i].rgba[channel]))
            << "query " << i << " channel " << channel;
      }
    }
  });
}

TEST(Texture, TexelCentresAreAtHalfIntegersAndTheFirstRowIsOnTop) {
  TextureTables tables;
  uint32_t next = 0;
  const int texture =
      AddTexture(tables, 4, 2, TexelFormat::rgba8, false, [&] { return next++ * 16; });
  std::vector<TextureQuery> queries;
  for (const int filter : {0, kFilterMagNearest | kFilterMinNearest}) {
    const int slot = AddSlot(tables, texture, kWrapRepeat, kWrapRepeat, filter);
    for (int i = 0; i < 8; ++i) {
      queries.push_back(
          {slot, (static_cast<float>(i % 4) + 0.5f) / 4, (static_cast<float>(i / 4) + 0.5f) / 2});
    }
  }
  OnEveryTarget(tables, queries, [&](const auto& wide, const auto&) {
    for (int i = 0; i < 16; ++i) {
      EXPECT_EQ(wide[i].rgba[0], static_cast<float>(i % 8 * 16) * (1.0f / 255)) << i;
    }
  });
}

TEST(Texture, EdgesFollowTheWrapMode) {
  TextureTables tables;
  int next = 0;
  const int texture =
      AddTexture(tables, 2, 1, TexelFormat::rgba8, false, [&] { return next++ == 1 ? 255u : 0u; });
  std::vector<TextureQuery> queries;
  for (const int wrap : {kWrapRepeat, kWrapClamp, kWrapMirror}) {
    const int slot = AddSlot(tables, texture, wrap, wrap, 0);
    for (const float u : {0.0f, 1.0f, -1e-9f, 1.25f, -0.25f, 2.5f})
      queries.push_back({slot, u, 0.5f});
  }
  // Texels 0 | 1. Repeat blends both at the seam; clamp and mirror show the edge alone.
  const float expected[] = {0.5f, 0.5f, 0.5f, 0, 1, 0.5f,   // repeat
                            0,    1,    0,    1, 0, 1,      // clamp
                            0,    1,    0,    1, 0, 0.5f};  // mirror
  OnEveryTarget(tables, queries, [&](const auto& wide, const auto&) {
    for (size_t i = 0; i < queries.size(); ++i)
      EXPECT_NEAR(wide[i].rgba[0], expected[i], 1e-6) << i;
  });
}

TEST(Texture, ConstantTexturesStayExactlyConstant) {
  TextureTables tables;
  Random random(3);
  std::vector<TextureQuery> queries;
  std::vector<double> expected;
  for (const uint32_t code : {0u, 1u, 97u, 128u, 254u, 255u}) {
    for (const bool srgb : {false, true}) {
      const int texture =
          AddTexture(tables, 13, 9, TexelFormat::rgba8, srgb, [&] { return code * 0x01010101u; });
      const int slot = AddSlot(tables, texture, kWrapRepeat, kWrapMirror, 0);
      for (int i = 0; i < 200; ++i) {
        queries.push_back(RandomQuery(random, slot));
        expected.push_back(srgb ? SrgbDecode8()[code] : static_cast<float>(code) * (1.0f / 255));
      }
    }
  }
  OnEveryTarget(tables, queries, [&](const auto& wide, const auto&) {
    for (size_t i = 0; i < queries.size(); ++i) ASSERT_EQ(wide[i].rgba[1], expected[i]) << i;
  });
}

TEST(Texture, WhiteIsOneInEveryFormat) {
  TextureTables tables;
  std::vector<TextureQuery> queries;
  for (const TexelFormat format : {TexelFormat::rgba8, TexelFormat::rgba16}) {
    for (const bool srgb : {false, true}) {
      const int texture = AddTexture(tables, 2, 2, format, srgb, [] { return ~0u; });
      queries.push_back({AddSlot(tables, texture, 0, 0, 0), 0.3f, 0.7f});
    }
  }
  OnEveryTarget(tables, queries, [&](const auto& wide, const auto&) {
    for (const TextureResult& result : wide) {
      for (const float value : result.rgba) EXPECT_EQ(value, 1.0f);
    }
  });
}

TEST(Texture, HugeAndBrokenCoordinatesStayInsideTheTexture) {
  TextureTables tables;
  Random random(4);
  // The pool holds nothing else, so that the address sanitizer sees any step outside.
  const int texture =
      AddTexture(tables, 31, 17, TexelFormat::rgba16, true, [&] { return random.Bits(); });
  constexpr float kInf = std::numeric_limits<float>::infinity();
  const float values[] = {0,     -0.0f,  1,      1e6f,    -1e6f, 999999.9f, 1e9f,         -1e9f,
                          3e38f, -3e38f, 1e-40f, -1e-40f, kInf,  -kInf,     std::nanf("")};
  std::vector<TextureQuery> queries;
  for (int mode = 0; mode < 3 * 16; ++mode) {
    const int slot = AddSlot(tables, texture, mode % 3, mode % 3, mode / 3);
    for (const float u : values) {
      for (const float v : values) {
        for (const float footprint : {-1.0f, 0.0f, kInf, -kInf, std::nanf("")}) {
          queries.push_back({slot, u, v, footprint, 0.75f});
        }
      }
    }
  }
  OnEveryTarget(tables, queries, [&](const auto& wide, const auto& one) {
    for (size_t i = 0; i < queries.size(); ++i) {
      for (int channel = 0; channel < 4; ++channel) {
        ASSERT_GE(wide[i].rgba[channel], 0) << i;
        ASSERT_LE(wide[i].rgba[channel], 1) << i;
        ASSERT_EQ(wide[i].rgba[channel], one[i].rgba[channel]) << i;
      }
    }
  });
}

TEST(Texture, CoordinatesOfAMillionKeepTheirFraction) {
  TextureTables tables;
  Random random(5);
  const int texture =
      AddTexture(tables, 8, 8, TexelFormat::rgba8, false, [&] { return random.Bits(); });
  std::vector<TextureQuery> queries;
  for (const int wrap : {kWrapRepeat, kWrapMirror}) {
    const int slot = AddSlot(tables, texture, wrap, wrap, 0);
    for (int i = 0; i < 1000; ++i) {
      queries.push_back({slot, random.Uniform(-1e6f, 1e6f), random.Uniform(-1e6f, 1e6f)});
    }
  }
  OnEveryTarget(tables, queries, [&](const auto& wide, const auto&) {
    for (size_t i = 0; i < queries.size(); ++i) {
      const ReferenceSample reference = SampleReference(tables, queries[i]);
      for (int channel = 0; channel < 4; ++channel) {
        ASSERT_NEAR(wide[i].rgba[channel], reference.rgba[channel], 1e-6) << i;
      }
    }
  });
}

TEST(Texture, ChoosesLevelsWithTheFractionAsProbability) {
  TextureTables tables;
  uint32_t made = 0;  // level 0 has 16 texels of 0, level 1 four of 255
  const int texture =
      AddTexture(tables, 4, 4, TexelFormat::rgba8, false, [&] { return made++ < 16 ? 0u : 255u; });
  const int slot = AddSlot(tables, texture, 0, 0, 0);
  std::vector<TextureQuery> queries;
  constexpr int kCount = 1000;
  for (int i = 0; i < kCount; ++i) {
    queries.push_back({slot, 0.4f, 0.4f, -2 + 0.3f, (static_cast<float>(i) + 0.5f) / kCount});
  }
  OnEveryTarget(tables, queries, [&](const auto& wide, const auto&) {
    double sum = 0;
    for (const TextureResult& result : wide) sum += result.rgba[0];
    EXPECT_NEAR(sum / kCount, 0.3, 1.5 / kCount);
  });
}

}  // namespace
}  // namespace carpool::stages
#endif  // HWY_ONCE
