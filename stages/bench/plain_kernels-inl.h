// The sampler and the BSDF as one would write them in plain scalar C++: what one-lane kernels are
// held to.
//
// Same formulas and tables as stages/sampling and stages/kernels, with branches where a scalar
// program branches. It is compiled once per SIMD target, so that both sides may use the same
// instructions.

#if defined(CARPOOL_STAGES_BENCH_PLAIN_KERNELS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_BENCH_PLAIN_KERNELS_INL_H_
#undef CARPOOL_STAGES_BENCH_PLAIN_KERNELS_INL_H_
#else
#define CARPOOL_STAGES_BENCH_PLAIN_KERNELS_INL_H_
#endif

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "hwy/highway.h"
#include "stages/sampling/dimensions.h"
#include "stages/tables/bsdf_tables.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {
namespace plain {

constexpr float kPiF = std::numbers::pi_v<float>;

inline float Fma(float a, float b, float c) {
#if HWY_NATIVE_FMA
  return std::fma(a, b, c);
#else
  return a * b + c;
#endif
}

// ---- Sampler

struct Key {
  uint32_t seed, reversed_index;
};
struct Float2 {
  float x, y;
};

inline uint32_t Mix(uint32_t x) {
  x = (x ^ (x >> 16)) * 0x21f0aaadu;
  x = (x ^ (x >> 15)) * 0xd35a2d97u;
  return x ^ (x >> 15);
}
inline uint32_t Reverse(uint32_t x) {
  x = __builtin_bswap32(x);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  return ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
}
inline uint32_t Scramble(uint32_t x, uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1;
  x ^= x * 0x05526c56u;
  return x ^ (x * 0x53a22864u);
}
inline uint32_t SecondSobol(uint32_t x) {
  x ^= x >> 16;
  x ^= (x >> 8) & 0x00ff00ffu;
  x ^= (x >> 4) & 0x0f0f0f0fu;
  x ^= (x >> 2) & 0x33333333u;
  return x ^ ((x >> 1) & 0x55555555u);
}
inline float Unit(uint32_t word) {
  return static_cast<float>(static_cast<int32_t>(word >> 8)) * 0x1p-24f;
}
inline uint32_t Derive(uint32_t hash, uint32_t odd) {
  const uint32_t x = hash * odd;
  return x ^ (x >> 16);
}
inline Key MakeKey(uint32_t pixel, uint32_t sample, uint32_t seed_hash) {
  return {Mix(Mix(pixel + seed_hash) + (sample & 3) * 0x9e3779b9u), Reverse(sample >> 2)};
}
inline Float2 Sample2(const Key& key, uint32_t vertex, Purpose purpose) {
  const uint32_t hash =
      Mix(key.seed + (vertex * kPurposesPerVertex + static_cast<uint32_t>(purpose)) * 0x9e3779b9u);
  const uint32_t index = Reverse(Scramble(key.reversed_index, hash));
  return {Unit(Reverse(Scramble(index, Derive(hash, 0x85ebca6bu)))),
          Unit(Reverse(Scramble(SecondSobol(index), Derive(hash, 0xc2b2ae35u))))};
}

// ---- BSDF

struct Float3 {
  float x, y, z;
};
inline Float3 operator+(Float3 a, Float3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Float3 operator*(Float3 a, float s) {
  return {a.x * s, a.y * s, a.z * s};
}
inline Float3 FmaEach(Float3 a, float s, Float3 b) {
  return {Fma(a.x, s, b.x), Fma(a.y, s, b.y), Fma(a.z, s, b.z)};
}
inline float Dot(Float3 a, Float3 b) {
  return Fma(a.x, b.x, Fma(a.y, b.y, a.z * b.z));
}
inline float Sum(Float3 a) {
  return a.x + a.y + a.z;
}
inline float Largest(Float3 a) {
  return std::max(a.x, std::max(a.y, a.z));
}
inline float Clamp(float x) {
  return std::min(std::max(x, 0.0f), 1.0f);
}
inline Float3 Clamp(Float3 c) {
  return {Clamp(c.x), Clamp(c.y), Clamp(c.z)};
}
inline float Divide(float a, float b) {
  return b > 0 ? a / b : 0;
}
inline float Mixed(float t, float a, float b) {
  return Fma(t, b - a, a);
}

struct Params {
  Float3 base;
  float metallic, roughness, ior;
  bool ior_zero;
  float specular;
  Float3 specular_color;
};
struct Pair {
  float m, b;
};
struct Row {
  float alpha, fraction;
  int base;
  Pair average;
  float log2_spread;
};
struct Value {
  Float3 f_cos;
  float pdf;
};
struct Sampled {
  Float3 wi, weight;
  float pdf;
  bool valid;
};

inline float SchlickPower(float cosine) {
  const float x = std::max(1 - cosine, 0.0f), x2 = x * x;
  return x2 * x2 * x;
}

inline Row FindRow(const BsdfTablesView& tables, float roughness) {
  const float low = static_cast<float>(kMinRoughness);
  const float r = std::min(std::max(roughness, low), 1.0f);
  const float unit = (r - low) * static_cast<float>(1 / (1 - kMinRoughness));
  const float position = unit * (kAlbedoRoughnesses - 1), knot = unit * (kAverageRoughnesses - 1);
  const int row = std::min(static_cast<int>(position), kAlbedoRoughnesses - 2);
  const int k = std::min(static_cast<int>(knot), kAverageRoughnesses - 2);
  const float t = knot - static_cast<float>(k);
  const float* at = tables.average + k * kAverageColumns;
  return {r * r,
          position - static_cast<float>(row),
          row * kAlbedoCosines,
          {Mixed(t, at[0], at[kAverageColumns]), Mixed(t, at[1], at[kAverageColumns + 1])},
          Mixed(t, at[2], at[kAverageColumns + 2])};
}

inline Pair LookUpPair(const BsdfTablesView& tables, const Row& row, float mu) {
  mu = std::min(mu, 1.0f);
  const float follow = std::sqrt(mu * (1 + row.alpha) / (mu + row.alpha));
  const float position =
      Fma(follow, static_cast<float>(kAlbedoCoordinateShare * (kAlbedoCosines - 1)),
          mu * static_cast<float>((1 - kAlbedoCoordinateShare) * (kAlbedoCosines - 1)));
  const int column = std::min(static_cast<int>(position), kAlbedoCosines - 2);
  const float t = position - static_cast<float>(column);
  const int32_t* at = tables.albedo + row.base + column;
  const auto upper = [](int32_t w) {
    return static_cast<float>(static_cast<int32_t>(static_cast<uint32_t>(w) >> 16));
  };
  const auto lower = [](int32_t w) { return static_cast<float>(w & 0xffff); };
  const float m = Mixed(row.fraction, Mixed(t, upper(at[0]), upper(at[1])),
                        Mixed(t, upper(at[kAlbedoCosines]), upper(at[kAlbedoCosines + 1]))) *
                  static_cast<float>(kAlbedoUnitM);
  const float c = Fma(Mixed(row.fraction, Mixed(t, lower(at[0]), lower(at[1])),
                            Mixed(t, lower(at[kAlbedoCosines]), lower(at[kAlbedoCosines + 1]))),
                      static_cast<float>(kAlbedoUnitC), -1);
  return {m, std::max(Fma(1 - m, SchlickPower(mu), c), 0.0f)};
}

inline float PowerMinus1(float x) {
  const float whole = std::nearbyint(x);
  const float f = (x - whole) * std::numbers::ln2_v<float>;
  float y = Fma(f, 1.0f / 5040, 1.0f / 720);
  y = Fma(y, f, 1.0f / 120);
  y = Fma(y, f, 1.0f / 24);
  y = Fma(y, f, 1.0f / 6);
  y = Fma(y, f, 0.5f);
  y = Fma(y * f, f, f);
  const float power = std::bit_cast<float>((static_cast<int32_t>(whole) + 127) << 23);
  return Fma(power, y, power - 1);
}

inline Float2 CosSin(float turns) {
  const float quarters = std::nearbyint(turns * 4);
  const float angle = Fma(-quarters, 0.25f, turns) * (2 * kPiF), a2 = angle * angle;
  float c = Fma(a2, -1.0f / 3628800, 1.0f / 40320);
  c = Fma(Fma(Fma(Fma(c, a2, -1.0f / 720), a2, 1.0f / 24), a2, -0.5f), a2, 1);
  float s = Fma(a2, 1.0f / 362880, -1.0f / 5040);
  s = Fma(Fma(s, a2, 1.0f / 120), a2, -1.0f / 6);
  s = Fma(s * a2, angle, angle);
  const int quadrant = static_cast<int>(quarters);
  const float x = quadrant & 1 ? -s : c, y = quadrant & 1 ? c : s;
  return quadrant & 2 ? Float2{-x, -y} : Float2{x, y};
}

inline float Root(Float3 w, float alpha) {
  return std::sqrt(Fma(alpha * alpha, Fma(w.x, w.x, w.y * w.y), w.z * w.z));
}
inline Float3 Normal(Float3 v) {
  return v * (1 / std::sqrt(Dot(v, v)));
}

struct Surface {
  BsdfTablesView tables;
  Row row;
  float inverse_alpha, root_o, pdf_scale, f90, through, through_m, through_b, spread,
      natural_spread;
  Float3 f0, multi, diffuse;
  float specular_weight, multi_weight, diffuse_weight, total_weight, inverse_total;
};

inline float Passed(const Surface& s, Pair at) {
  return std::max(Fma(-s.through_m, at.m, Fma(-s.through_b, at.b, s.through)), 0.0f);
}
inline float Share(float f0, float f90, float m) {
  const float f = Fma(f90 - f0, 1.0f / 21, f0);
  return f * f * (1 - m) / Fma(-f, m, 1);
}
inline Float3 Share(Float3 f0, float f90, float m) {
  return {Share(f0.x, f90, m), Share(f0.y, f90, m), Share(f0.z, f90, m)};
}

inline Surface Prepare(const BsdfTablesView& tables, const Params& p, Float3 wo) {
  Surface s;
  s.tables = tables;
  s.row = FindRow(tables, p.roughness);
  s.inverse_alpha = 1 / s.row.alpha;
  s.root_o = Root(wo, s.row.alpha);
  s.pdf_scale = 0.5f / (wo.z + s.root_o);
  const float metallic = Clamp(p.metallic);
  const Float3 base = Clamp(p.base);
  const Pair at = LookUpPair(tables, s.row, std::max(wo.z, 0.0f));
  float reflectance = 1, grazing = 1;
  if (!p.ior_zero) {
    const float ior = std::max(p.ior, 1.0f), ratio = (ior - 1) / (ior + 1);
    const float faint = std::max(Fma(ior - 1, static_cast<float>(-1 / 0.36), 1), 0.0f);
    reflectance = ratio * ratio;
    grazing = Fma(-faint, faint, 1);
  }
  const float specular = Clamp(p.specular);
  const Float3 f0 = Clamp(p.specular_color * reflectance) * specular;
  const float f90 = grazing * specular;
  s.f0 = FmaEach(base + f0 * -1, metallic, f0);
  s.f90 = Fma(1 - f90, metallic, f90);
  s.specular_weight = Fma(Sum(s.f0), std::max(1 - at.m - at.b, 0.0f), 3 * s.f90 * at.b);
  const Float3 dielectric_multi = Share(f0, f90, s.row.average.m);
  s.multi = dielectric_multi * (1 - metallic);
  if (metallic > 0) s.multi = FmaEach(Share(base, 1, s.row.average.m), metallic, s.multi);
  s.multi = s.multi * Divide(at.m, s.row.average.m);
  s.multi_weight = Sum(s.multi) * s.row.average.m;
  s.natural_spread = s.row.log2_spread * std::numbers::ln2_v<float>;
  s.spread = 1 / PowerMinus1(s.row.log2_spread);
  const float largest = Largest(f0);
  s.through = 1 - largest;
  s.through_m = Largest(dielectric_multi) - largest;
  s.through_b = f90 - largest;
  const float passed = Passed(s, s.row.average);
  s.diffuse = base * (Divide(Passed(s, at), passed) * (1 - metallic));
  s.diffuse_weight = Sum(s.diffuse) * passed;
  s.total_weight = s.specular_weight + s.multi_weight + s.diffuse_weight;
  s.inverse_total = Divide(1, s.total_weight);
  return s;
}

inline Value Evaluate(const Surface& s, Float3 wo, Float3 wi) {
  if (!(wi.z > 0)) return {{0, 0, 0}, 0};
  Float3 f{0, 0, 0};
  float pdf = 0;
  if (s.specular_weight > 0) {
    const Float3 half = wo + wi;
    const float length2 = Dot(half, half), inverse = s.inverse_alpha, x = half.x * inverse,
                y = half.y * inverse;
    const float ratio = length2 / std::max(Fma(x, x, Fma(y, y, half.z * half.z)), 1e-37f) * inverse;
    const float distribution = ratio * ratio * (1 / kPiF);
    const float joint = Fma(wi.z, s.root_o, wo.z * Root(wi, s.row.alpha));
    const float value = distribution * (0.5f * wi.z / std::max(joint, 1e-37f));
    const float power = SchlickPower(std::sqrt(length2) * 0.5f);
    const Float3 fresnel{Fma(s.f90 - s.f0.x, power, s.f0.x), Fma(s.f90 - s.f0.y, power, s.f0.y),
                         Fma(s.f90 - s.f0.z, power, s.f0.z)};
    f = fresnel * value;
    pdf = s.specular_weight * s.pdf_scale * distribution;
  }
  if (s.multi_weight + s.diffuse_weight > 0) {
    const Pair at = LookUpPair(s.tables, s.row, wi.z);
    const float cosine = wi.z * (1 / kPiF);
    if (s.multi_weight > 0) {
      f = FmaEach(s.multi, cosine * at.m, f);
      pdf = Fma(s.multi_weight, cosine / (Fma(wi.z, wi.z, s.spread) * s.natural_spread), pdf);
    }
    if (s.diffuse_weight > 0) {
      f = FmaEach(s.diffuse, cosine * Passed(s, at), f);
      pdf = Fma(s.diffuse_weight, cosine, pdf);
    }
  }
  return {f, pdf * s.inverse_total};
}

inline Float3 SampleSpecular(const Surface& s, Float3 wo, Float2 u) {
  const float alpha = s.row.alpha;
  const Float3 stretched = Normal({wo.x * alpha, wo.y * alpha, wo.z});
  const float whole = 1 + stretched.z, below = u.y * whole, square = below * (2 - below);
  const float sine = square > 0 ? std::sqrt(square) : 0;
  const Float2 turn = CosSin(u.x);
  const Float3 half{Fma(sine, turn.x, stretched.x), Fma(sine, turn.y, stretched.y),
                    (1 - u.y) * whole};
  const Float3 normal = Normal({half.x * alpha, half.y * alpha, half.z});
  const float twice = 2 * Dot(wo, normal);
  return {Fma(normal.x, twice, -wo.x), Fma(normal.y, twice, -wo.y), Fma(normal.z, twice, -wo.z)};
}
inline Float3 SampleMulti(const Surface& s, Float2 u) {
  const float mu2 = std::min(s.spread * PowerMinus1((u.y + 0x1p-25f) * s.row.log2_spread), 1.0f);
  const float sine = std::sqrt(1 - mu2);
  const Float2 turn = CosSin(u.x);
  return {sine * turn.x, sine * turn.y, std::sqrt(mu2)};
}
inline Float3 SampleDiffuse(Float2 u) {
  const float a = Fma(u.x, 2, 0x1p-24f - 1), b = Fma(u.y, 2, 0x1p-24f - 1);
  const bool wide = std::abs(a) > std::abs(b);
  const float r = wide ? a : b, size = std::abs(r);
  const Float2 turn = CosSin((wide ? b : a) / r * 0.125f);
  return {r * (wide ? turn.x : turn.y), r * (wide ? turn.y : turn.x),
          std::sqrt((1 - size) * (1 + size))};
}

inline Sampled SampleSurface(const Surface& s, Float3 wo, float u_lobe, Float2 u) {
  const float target = u_lobe * s.total_weight;
  Float3 wi{0, 0, 1};
  if (target < s.specular_weight) {
    wi = SampleSpecular(s, wo, u);
  } else if (target < s.specular_weight + s.multi_weight) {
    wi = SampleMulti(s, u);
  } else if (target < s.total_weight) {
    wi = SampleDiffuse(u);
  }
  const Value value = Evaluate(s, wo, wi);
  if (!(value.pdf > 0)) return {wi, {0, 0, 0}, 0, false};
  return {wi, value.f_cos * (1 / value.pdf), value.pdf, true};
}

}  // namespace plain
}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
