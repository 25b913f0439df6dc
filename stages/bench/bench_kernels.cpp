// bench-kernels: one-lane kernels against plain scalar C++, and full SIMD width against one lane.
//
//   bench-kernels [--json FILE]
//
// Ratios compare runs that alternate within one process; each is the median over rounds.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stages/bench/bench_kernels.cpp"
#include "hwy/foreach_target.h"

#include "stages/bench/plain_texture-inl.h"
#include "stages/kernels/bsdf-inl.h"
#include "stages/kernels/texture-inl.h"
#include "stages/sampling/sobol-inl.h"

#ifndef CARPOOL_STAGES_BENCH_KERNELS_TYPES
#define CARPOOL_STAGES_BENCH_KERNELS_TYPES
namespace carpool::stages::bench {

constexpr size_t kItems = 4096;

/// Inputs and outputs of a run: columns of kItems, small enough for L2.
struct Work {
  std::vector<uint32_t> pixel, sample, vertex;
  std::vector<float> in[20];
  std::vector<float> out[3];
  TextureTables textures;
};
enum Column {
  kBase = 0,
  kMetallic = 3,
  kRoughness,
  kIor,
  kSpecular,
  kSpecularColor = 7,
  kWo = 10,
  kLobe = 13,
  kU = 14,
  kWi = 16,
  kUv = 14,
  kFootprint = 19
};

/// The slots of a textured metallic-roughness material: colour, metallic-roughness, normal.
constexpr int kSlots = 3;

/// One kernel, three ways, on one target.
struct Contest {
  const char* name;
  void (*plain)(Work&);
  void (*one)(Work&);
  void (*wide)(Work&);
};

}  // namespace carpool::stages::bench
#endif

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

using bench::Work;
using namespace bench;  // NOLINT: the columns' names

void PlainSampler(Work& w) {
  const uint32_t seed_hash = plain::Mix(0x9e3779b9u);
  for (size_t i = 0; i < kItems; ++i) {
    const plain::Key key = plain::MakeKey(w.pixel[i], w.sample[i], seed_hash);
    const plain::Float2 a = plain::Sample2(key, w.vertex[i], Purpose::bsdf);
    const plain::Float2 b = plain::Sample2(key, w.vertex[i], Purpose::light_point);
    w.out[0][i] = a.x + b.x;
    w.out[1][i] = a.y + b.y;
  }
}

template <class D>
void LaneSampler(Work& w) {
  const D d;
  const WordTag<D> dw;
  for (size_t i = 0; i < kItems; i += hn::Lanes(d)) {
    const SampleKey<D> key =
        MakeSampleKey(d, hn::LoadU(dw, &w.pixel[i]), hn::LoadU(dw, &w.sample[i]), 0);
    const Word<D> vertex = hn::LoadU(dw, &w.vertex[i]);
    const Vec2<D> a = Sample2D(d, key, vertex, Purpose::bsdf);
    const Vec2<D> b = Sample2D(d, key, vertex, Purpose::light_point);
    hn::StoreU(a.x + b.x, d, &w.out[0][i]);
    hn::StoreU(a.y + b.y, d, &w.out[1][i]);
  }
}

plain::Params PlainParams(const Work& w, size_t i) {
  return {{w.in[kBase][i], w.in[kBase + 1][i], w.in[kBase + 2][i]},
          w.in[kMetallic][i],
          w.in[kRoughness][i],
          w.in[kIor][i],
          false,
          w.in[kSpecular][i],
          {w.in[kSpecularColor][i], w.in[kSpecularColor + 1][i], w.in[kSpecularColor + 2][i]}};
}
plain::Float3 PlainVector(const Work& w, int column, size_t i) {
  return {w.in[column][i], w.in[column + 1][i], w.in[column + 2][i]};
}

template <class D>
Vec3<D> LaneVector(D d, const Work& w, int column, size_t i) {
  return {hn::LoadU(d, &w.in[column][i]), hn::LoadU(d, &w.in[column + 1][i]),
          hn::LoadU(d, &w.in[column + 2][i])};
}
template <class D>
SurfaceParams<D> LaneParams(D d, const Work& w, size_t i) {
  return {LaneVector(d, w, kBase, i),         hn::LoadU(d, &w.in[kMetallic][i]),
          hn::LoadU(d, &w.in[kRoughness][i]), hn::LoadU(d, &w.in[kIor][i]),
          hn::Lt(hn::Zero(d), hn::Zero(d)),   hn::LoadU(d, &w.in[kSpecular][i]),
          LaneVector(d, w, kSpecularColor, i)};
}

/// What shading does at a vertex: prepare, evaluate the light's direction, sample the next.
void PlainBsdf(Work& w) {
  const BsdfTablesView tables = SharedBsdfTables().View();
  for (size_t i = 0; i < kItems; ++i) {
    const plain::Float3 wo = PlainVector(w, kWo, i);
    const plain::Surface s = plain::Prepare(tables, PlainParams(w, i), wo);
    const plain::Value v = plain::Evaluate(s, wo, PlainVector(w, kWi, i));
    const plain::Sampled next =
        plain::SampleSurface(s, wo, w.in[kLobe][i], {w.in[kU][i], w.in[kU + 1][i]});
    w.out[0][i] = v.f_cos.x + v.f_cos.y + v.f_cos.z + v.pdf;
    w.out[1][i] = next.wi.x + next.wi.y + next.wi.z;
    w.out[2][i] = next.weight.x + next.weight.y + next.weight.z + next.pdf;
  }
}

template <class D>
void LaneBsdf(Work& w) {
  const D d;
  const BsdfTablesView tables = SharedBsdfTables().View();
  for (size_t i = 0; i < kItems; i += hn::Lanes(d)) {
    const Vec3<D> wo = LaneVector(d, w, kWo, i);
    const Bsdf<D> bsdf = PrepareBsdf(d, tables, LaneParams(d, w, i), wo);
    const BsdfValue<D> v = EvaluateBsdf(d, bsdf, wo, LaneVector(d, w, kWi, i));
    const Vec2<D> u{hn::LoadU(d, &w.in[kU][i]), hn::LoadU(d, &w.in[kU + 1][i])};
    const BsdfSample<D> next = SampleBsdf(d, bsdf, wo, hn::LoadU(d, &w.in[kLobe][i]), u);
    hn::StoreU(SumComponents(v.f_cos) + v.pdf, d, &w.out[0][i]);
    hn::StoreU(SumComponents(next.wi), d, &w.out[1][i]);
    hn::StoreU(SumComponents(next.weight) + next.pdf, d, &w.out[2][i]);
  }
}

void PlainTexture(Work& w) {
  const TextureTablesView view = ViewOf(w.textures);
  for (size_t i = 0; i < kItems; ++i) {
    for (int slot = 0; slot < kSlots; ++slot) {
      const plain::Float4 c = plain::SampleTexture(view, slot, {w.in[kUv][i], w.in[kUv + 1][i]},
                                                   w.in[kFootprint][i], w.in[kLobe][i]);
      w.out[slot][i] = c.r + c.g + c.b + c.a;
    }
  }
}

template <class D>
void LaneTexture(Work& w) {
  const D d;
  const TextureTablesView view = ViewOf(w.textures);
  for (size_t i = 0; i < kItems; i += hn::Lanes(d)) {
    const Vec2<D> uv{hn::LoadU(d, &w.in[kUv][i]), hn::LoadU(d, &w.in[kUv + 1][i])};
    for (int slot = 0; slot < kSlots; ++slot) {
      const Rgba<D> c =
          SampleTexture(d, view, hn::Set(IntTag<D>(), slot), hn::FirstN(d, kItems), uv,
                        hn::LoadU(d, &w.in[kFootprint][i]), hn::LoadU(d, &w.in[kLobe][i]));
      hn::StoreU(SumComponents(c.rgb) + c.a, d, &w.out[slot][i]);
    }
  }
}

std::vector<bench::Contest> KernelContests() {
  using One = hn::CappedTag<float, 1>;
  using Wide = hn::ScalableTag<float>;
  return {{"sampler", PlainSampler, LaneSampler<One>, LaneSampler<Wide>},
          {"bsdf", PlainBsdf, LaneBsdf<One>, LaneBsdf<Wide>},
          {"texture", PlainTexture, LaneTexture<One>, LaneTexture<Wide>}};
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carpool::stages {
HWY_EXPORT(KernelContests);
namespace bench {
namespace {

/// Three images of 128x128 random texels with their mips, the first sRGB, read with the sampler of
/// glTF's default.
TextureTables MakeTextures(std::mt19937& random) {
  TextureTables tables;
  for (int slot = 0; slot < kSlots; ++slot) {
    Texture image;
    image.width = image.height = 128;
    image.levels = 8;
    image.srgb = slot == 0;
    for (int level = 0; level < image.levels; ++level) {
      image.level_offset[level] = static_cast<int32_t>(tables.words.size());
      const size_t side = static_cast<size_t>(image.width) >> level;
      for (size_t texel = 0; texel < side * side; ++texel) tables.words.push_back(random());
    }
    tables.textures.push_back(image);
    tables.slots.push_back({.texture = slot});
  }
  return tables;
}

Work MakeWork() {
  Work w;
  std::mt19937 random(1);
  w.textures = MakeTextures(random);
  const auto uniform = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  for (auto& column : w.in) column.resize(kItems);
  for (auto& column : w.out) column.resize(kItems);
  for (size_t i = 0; i < kItems; ++i) {
    w.pixel.push_back(random());
    w.sample.push_back(static_cast<uint32_t>(i % 64));
    w.vertex.push_back(1 + i % 5);
    for (auto& column : w.in) column[i] = uniform();
    w.in[kIor][i] = 1.5f;
    w.in[kSpecular][i] = 1;
    for (int c = 0; c < 3; ++c) w.in[kSpecularColor + c][i] = 1;
    // As in scenes: half the surfaces are dielectric, most others metal.
    w.in[kMetallic][i] = i % 2 == 0 ? 0.0f : i % 8 == 1 ? 0.5f : 1.0f;
    w.in[kFootprint][i] = -8 + 4 * w.in[kFootprint][i];  // levels 0 to 3
    for (const int column : {kWo, kWi}) {
      const float z = 0.02f + 0.98f * uniform(), sine = std::sqrt(1 - z * z),
                  angle = 6.2831853f * uniform();
      w.in[column][i] = sine * std::cos(angle);
      w.in[column + 1][i] = sine * std::sin(angle);
      w.in[column + 2][i] = z;
    }
  }
  return w;
}

/// Nanoseconds per item of one pass.
double TimePass(void (*run)(Work&), Work& w) {
  const auto start = std::chrono::steady_clock::now();
  run(w);
  return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start)
             .count() /
         kItems;
}

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

struct Row {
  std::string name, unit;
  double value;
  double target;  // 0: none; ratios of one lane must stay below it
};

/// Largest difference of results between the ways; they take the same branches, so only rounding
/// differs.
double Disagreement(const Work& a, const Work& b) {
  size_t apart = 0;
  for (int c = 0; c < 3; ++c) {
    for (size_t i = 0; i < kItems; ++i) {
      const double x = a.out[c][i], y = b.out[c][i];
      apart += std::abs(x - y) > 0.01 * (1 + std::abs(x));
    }
  }
  return static_cast<double>(apart) / (3 * kItems);
}

void RunContest(const Contest& contest, const std::string& target, std::vector<Row>& rows) {
  Work w = MakeWork(), check = w;
  contest.plain(check);
  contest.one(w);
  const double apart = Disagreement(w, check);
  constexpr int kRounds = 301;
  std::vector<double> times[3], one_over_plain, one_over_wide;
  for (int round = 0; round < kRounds; ++round) {
    const double plain = TimePass(contest.plain, w), one = TimePass(contest.one, w),
                 wide = TimePass(contest.wide, w);
    times[0].push_back(plain), times[1].push_back(one), times[2].push_back(wide);
    one_over_plain.push_back(one / plain);
    one_over_wide.push_back(one / wide);
  }
  const std::string name = target + "/" + contest.name;
  rows.push_back({name + "/plain", "ns", Median(times[0]), 0});
  rows.push_back({name + "/one-lane", "ns", Median(times[1]), 0});
  rows.push_back({name + "/full-width", "ns", Median(times[2]), 0});
  rows.push_back({name + "/one-lane-over-plain", "ratio", Median(one_over_plain), 1.05});
  rows.push_back({name + "/full-width-gain", "ratio", Median(one_over_wide), 0});
  rows.push_back({name + "/results-apart", "share", apart, 0.001});
}

void Print(const std::vector<Row>& rows) {
  std::printf("%-36s %10s %-6s %8s %s\n", "name", "value", "unit", "target", "holds");
  for (const Row& row : rows) {
    std::printf("%-36s %10.3f %-6s ", row.name.c_str(), row.value, row.unit.c_str());
    if (row.target == 0) {
      std::printf("\n");
    } else {
      std::printf("%8.3f %s\n", row.target, row.value <= row.target ? "yes" : "NO");
    }
  }
}

bool WriteJson(const std::vector<Row>& rows, const char* path) {
  std::FILE* file = std::fopen(path, "w");
  if (file == nullptr) return false;
  std::fprintf(file, "[\n");
  for (size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    std::fprintf(file, "  {\"name\": \"%s\", \"value\": %.6g, \"unit\": \"%s\", ", row.name.c_str(),
                 row.value, row.unit.c_str());
    if (row.target == 0) {
      std::fprintf(file, "\"target\": null, \"holds\": null}");
    } else {
      std::fprintf(file, "\"target\": %.6g, \"holds\": %s}", row.target,
                   row.value <= row.target ? "true" : "false");
    }
    std::fprintf(file, "%s\n", i + 1 < rows.size() ? "," : "");
  }
  std::fprintf(file, "]\n");
  return std::fclose(file) == 0;
}

std::vector<Row> RunAll() {
  std::vector<Row> rows;
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    for (const Contest& contest : HWY_DYNAMIC_DISPATCH(KernelContests)())
      RunContest(contest, hwy::TargetName(target), rows);
  }
  hwy::SetSupportedTargetsForTest(0);
  return rows;
}

}  // namespace
}  // namespace bench
}  // namespace carpool::stages

int main(int argc, char** argv) {
  const bool json = argc == 3 && std::strcmp(argv[1], "--json") == 0;
  if (argc != 1 && !json) {
    std::fprintf(stderr, "bench-kernels: unknown arguments; use bench-kernels [--json FILE]\n");
    return 2;
  }
  const auto rows = carpool::stages::bench::RunAll();
  carpool::stages::bench::Print(rows);
  if (json && !carpool::stages::bench::WriteJson(rows, argv[2])) {
    std::fprintf(stderr, "bench-kernels: cannot write %s\n", argv[2]);
    return 4;
  }
  return 0;
}
#endif  // HWY_ONCE
