// Random numbers as pure functions of (pixel, sample, dimension, seed): padded, Owen-scrambled
// Sobol pairs.
//
// Each (vertex, purpose) takes the first two Sobol dimensions, which form a (0,m,2)-net, shuffles
// the sample order by a nested uniform scramble and Owen-scrambles both values (Burley 2020,
// "Practical Hash-based Owen Scrambling"). Scrambles work on bit-reversed words, so words stay
// reversed for as long as they can. Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_SAMPLING_SOBOL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_SAMPLING_SOBOL_INL_H_
#undef CARPOOL_STAGES_SAMPLING_SOBOL_INL_H_
#else
#define CARPOOL_STAGES_SAMPLING_SOBOL_INL_H_
#endif

#include <cstdint>

#include "stages/mutants.h"
#include "stages/sampling/dimensions.h"
#include "stages/sampling/lookup-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// What all numbers of one sample share.
template <class D>
struct SampleKey {
  Word<D> seed;            // hash of pixel, scramble group and user seed
  Word<D> reversed_index;  // index within the scramble group, its bits reversed
};

/// Bijective mixing of 32 bits: two rounds of xor-shift and multiply, constants found by search
/// (github.com/skeeto/hash-prospector; bias 0.107).
template <class DW>
HWY_INLINE hn::Vec<DW> MixWord(DW dw, hn::Vec<DW> x) {
  x = hn::Xor(x, hn::ShiftRight<16>(x)) * hn::Set(dw, 0x21f0aaadu);
  x = hn::Xor(x, hn::ShiftRight<15>(x)) * hn::Set(dw, 0xd35a2d97u);
  return hn::Xor(x, hn::ShiftRight<15>(x));
}
constexpr uint32_t MixWordScalar(uint32_t x) {
  x = (x ^ (x >> 16)) * 0x21f0aaadu;
  x = (x ^ (x >> 15)) * 0xd35a2d97u;
  return x ^ (x >> 15);
}

/// Reverses the bits of each word: nibbles by table, then bytes by shuffle.
template <class DW>
HWY_INLINE hn::Vec<DW> ReverseWordBits(DW dw, hn::Vec<DW> x) {
  const hn::Repartition<uint8_t, DW> db;
  // Look-ups need a whole 128-bit block of table however few lanes are looked up.
  const hn::CappedTag<uint8_t, (hn::MaxLanes(db) < 16 ? 16 : HWY_LANES(uint8_t))> dt;
  alignas(16) static constexpr uint8_t kLowNibble[16] = {0x00, 0x80, 0x40, 0xc0, 0x20, 0xa0,
                                                         0x60, 0xe0, 0x10, 0x90, 0x50, 0xd0,
                                                         0x30, 0xb0, 0x70, 0xf0};
  alignas(16) static constexpr uint8_t kHighNibble[16] = {0x0, 0x8, 0x4, 0xc, 0x2, 0xa, 0x6, 0xe,
                                                          0x1, 0x9, 0x5, 0xd, 0x3, 0xb, 0x7, 0xf};
  alignas(16) static constexpr uint8_t kSwap[16] = {3,  2,  1, 0, 7,  6,  5,  4,
                                                    11, 10, 9, 8, 15, 14, 13, 12};
  const auto nibble = hn::Set(dw, 0x0f0f0f0fu);
  const auto low = hn::BitCast(db, hn::And(x, nibble));
  const auto high = hn::BitCast(db, hn::And(hn::ShiftRight<4>(x), nibble));
  const auto bytes = hn::Or(hn::TableLookupBytes(hn::LoadDup128(dt, kLowNibble), low),
                            hn::TableLookupBytes(hn::LoadDup128(dt, kHighNibble), high));
  return hn::BitCast(dw, hn::TableLookupBytes(bytes, hn::LoadDup128(db, kSwap)));
}

/// Owen scramble of a bit-reversed word: each bit is flipped by a hash of the seed and the bits
/// below it. Laine-Karras construction with Vegdahl's 2021 constants
/// (psychopath.io/post/2021_01_30_building_a_better_lk_hash).
template <class DW>
HWY_INLINE hn::Vec<DW> ScrambleReversed(DW dw, hn::Vec<DW> x, hn::Vec<DW> seed) {
  x = hn::Xor(x, x * hn::Set(dw, 0x3d20adeau));
  x = x + seed;
  x = x * hn::Or(hn::ShiftRight<16>(seed), hn::Set(dw, 1u));
  x = hn::Xor(x, x * hn::Set(dw, 0x05526c56u));
  return hn::Xor(x, x * hn::Set(dw, 0x53a22864u));
}

/// The second Sobol dimension of `index`, bit-reversed: Pascal's triangle modulo 2, which is a
/// Kronecker power of [1 1; 0 1], applied to the index bits in five steps.
template <class DW>
HWY_INLINE hn::Vec<DW> ReversedSecondSobol(DW dw, hn::Vec<DW> index) {
  hn::Vec<DW> x = hn::Xor(index, hn::ShiftRight<16>(index));
  x = hn::Xor(x, hn::And(hn::ShiftRight<8>(x), hn::Set(dw, 0x00ff00ffu)));
  x = hn::Xor(x, hn::And(hn::ShiftRight<4>(x), hn::Set(dw, 0x0f0f0f0fu)));
  x = hn::Xor(x, hn::And(hn::ShiftRight<2>(x), hn::Set(dw, 0x33333333u)));
  return hn::Xor(x, hn::And(hn::ShiftRight<1>(x), hn::Set(dw, 0x55555555u)));
}

/// [0, 1) from the upper 24 bits, exactly: dividing all 32 would round 128 words up to 1.0f.
template <class D>
HWY_INLINE Real<D> UnitFromWord(D d, Word<D> word) {
  const hn::Rebind<int32_t, D> di;
  const auto integer = hn::BitCast(di, hn::ShiftRight<8>(word));
  if (IsMutant(Mutant::naive_uniform)) {
    const auto all = hn::BitCast(di, hn::ShiftRight<1>(word));
    if constexpr (sizeof(hn::TFromD<D>) == 4) return hn::ConvertTo(d, all) * Splat(d, 0x1p-31);
  }
  if constexpr (sizeof(hn::TFromD<D>) == 4) {
    return hn::ConvertTo(d, integer) * Splat(d, 0x1p-24);
  } else {
    return hn::PromoteTo(d, integer) * Splat(d, 0x1p-24);
  }
}

template <class D>
HWY_INLINE SampleKey<D> MakeSampleKey(D, Word<D> pixel_index, Word<D> sample, uint32_t user_seed) {
  const WordTag<D> dw;
  const Word<D> pixel =
      MixWord(dw, pixel_index + hn::Set(dw, MixWordScalar(user_seed + 0x9e3779b9u)));
  const Word<D> group = hn::And(sample, hn::Set(dw, kScrambleGroups - 1));
  static_assert(kScrambleGroups == 4);
  return {MixWord(dw, pixel + group * hn::Set(dw, 0x9e3779b9u)),
          ReverseWordBits(dw, hn::ShiftRight<2>(sample))};
}

/// Hash of everything but the sample: one scramble per pixel, group, vertex and purpose.
template <class D>
HWY_INLINE Word<D> DimensionSeed(const SampleKey<D>& key, Word<D> vertex, Purpose purpose) {
  const WordTag<D> dw;
  const Word<D> dimension =
      vertex * hn::Set(dw, kPurposesPerVertex) + hn::Set(dw, static_cast<uint32_t>(purpose));
  return MixWord(dw, key.seed + dimension * hn::Set(dw, 0x9e3779b9u));
}

/// A seed of its own for each use of a dimension's hash: scrambles flip their first digits by the
/// lowest bits, so those must come from all bits of the hash.
template <class DW>
HWY_INLINE hn::Vec<DW> DeriveSeed(DW dw, hn::Vec<DW> hash, uint32_t odd) {
  const hn::Vec<DW> x = hash * hn::Set(dw, odd);
  return hn::Xor(x, hn::ShiftRight<16>(x));
}

template <class D>
HWY_INLINE Real<D> Sample1D(D d, const SampleKey<D>& key, Word<D> vertex, Purpose purpose) {
  const WordTag<D> dw;
  const Word<D> hash = DimensionSeed<D>(key, vertex, purpose);
  const Word<D> index = ReverseWordBits(dw, ScrambleReversed(dw, key.reversed_index, hash));
  const Word<D> x = ScrambleReversed(dw, index, DeriveSeed(dw, hash, 0x85ebca6bu));
  return UnitFromWord(d, ReverseWordBits(dw, x));
}

template <class D>
HWY_INLINE Vec2<D> Sample2D(D d, const SampleKey<D>& key, Word<D> vertex, Purpose purpose) {
  const WordTag<D> dw;
  const Word<D> hash = DimensionSeed<D>(key, vertex, purpose);
  const Word<D> index = ReverseWordBits(dw, ScrambleReversed(dw, key.reversed_index, hash));
  const Word<D> x = ScrambleReversed(dw, index, DeriveSeed(dw, hash, 0x85ebca6bu));
  const Word<D> y =
      ScrambleReversed(dw, ReversedSecondSobol(dw, index), DeriveSeed(dw, hash, 0xc2b2ae35u));
  return {UnitFromWord(d, ReverseWordBits(dw, x)), UnitFromWord(d, ReverseWordBits(dw, y))};
}

/// A plain hash for loops without bound (alpha layers, scattering events): uniform and independent
/// over iterations, without the low discrepancy of the numbers above.
template <class D>
HWY_INLINE Real<D> HashUniform(D d, const SampleKey<D>& key, Word<D> vertex, Purpose purpose,
                               Word<D> iteration) {
  const WordTag<D> dw;
  const Word<D> hash = DimensionSeed<D>(key, vertex, purpose);
  const Word<D> sample = MixWord(dw, hn::Xor(hash, key.reversed_index));
  return UnitFromWord(d, MixWord(dw, sample + iteration * hn::Set(dw, 0x9e3779b9u)));
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
