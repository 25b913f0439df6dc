// Table look-ups by index for the samplers and BSDF tables, safe at any width.
//
// Highway's x86 gathers read all four lanes of a register even when the tag has fewer, so that
// unused lanes would address memory at random; short tags therefore load scalars. Per-target
// header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_SAMPLING_LOOKUP_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_SAMPLING_LOOKUP_INL_H_
#undef CARPOOL_STAGES_SAMPLING_LOOKUP_INL_H_
#else
#define CARPOOL_STAGES_SAMPLING_LOOKUP_INL_H_
#endif

#include <cstdint>

#include "stages/simd/lanes-inl.h"
#include "stages/simd/quads-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// 32-bit words and indices, one per lane of D, whether D's lanes are float or double.
template <class D>
using WordTag = hn::Rebind<uint32_t, D>;
template <class D>
using Word = hn::Vec<WordTag<D>>;
template <class D>
using IndexTag = hn::Rebind<int32_t, D>;
template <class D>
using Index = hn::Vec<IndexTag<D>>;

/// Truncates towards zero.
template <class D>
HWY_INLINE Index<D> ToIndex(D, Real<D> x) {
  if constexpr (sizeof(hn::TFromD<D>) == 4) {
    return hn::ConvertTo(IndexTag<D>(), x);
  } else {
    return hn::DemoteTo(IndexTag<D>(), x);
  }
}
template <class D>
HWY_INLINE Real<D> FromIndex(D d, Index<D> i) {
  if constexpr (sizeof(hn::TFromD<D>) == 4) {
    return hn::ConvertTo(d, i);
  } else {
    return hn::PromoteTo(d, i);
  }
}

/// table[index]; every index must be in range.
template <class DT>
HWY_INLINE hn::Vec<DT> LookUp(DT dt, const hn::TFromD<DT>* HWY_RESTRICT table,
                              hn::Vec<hn::RebindToSigned<DT>> index) {
  if constexpr (hn::MaxLanes(DT()) == 1) {
    return hn::LoadU(dt, table + hn::GetLane(index));
  } else if constexpr (hn::MaxLanes(DT()) < 4) {
    int32_t lanes[4];
    hn::TFromD<DT> values[4];
    hn::StoreU(index, hn::RebindToSigned<DT>(), lanes);
    for (size_t i = 0; i < hn::Lanes(dt); ++i) values[i] = table[lanes[i]];
    return hn::LoadU(dt, values);
  } else {
    return hn::GatherIndex(dt, table, index);
  }
}

/// A table of floats as D's lanes, and a table of words.
template <class D>
HWY_INLINE Real<D> LookUpFloat(D d, const float* HWY_RESTRICT table, Index<D> index) {
  const hn::Rebind<float, D> df;
  if constexpr (sizeof(hn::TFromD<D>) == 4) {
    return LookUp(df, table, index);
  } else {
    return hn::PromoteTo(d, LookUp(df, table, index));
  }
}
template <class D>
HWY_INLINE Index<D> LookUpWord(D, const int32_t* HWY_RESTRICT table, Index<D> index) {
  return LookUp(IndexTag<D>(), table, index);
}

template <class D>
struct WordPair {
  Index<D> first, second;
};

/// Lanes are four floats or more, so that one load per lane brings four neighbouring words.
template <class D>
constexpr bool kLoadsQuads = sizeof(hn::TFromD<D>) == 4 && hn::MaxLanes(D()) >= 4;

/// table[index] and its successors. All of four words must be readable, also of a pair.
template <class D>
HWY_INLINE Quad<D> LookUpQuad(D d, const float* HWY_RESTRICT table, Index<D> index) {
  if constexpr (kLoadsQuads<D>) {
    return GatherQuad(d, table, index);
  } else {
    return {LookUpFloat(d, table, index), LookUpFloat(d, table + 1, index),
            LookUpFloat(d, table + 2, index), LookUpFloat(d, table + 3, index)};
  }
}
template <class D>
HWY_INLINE Vec2<D> LookUpFloatPair(D d, const float* HWY_RESTRICT table, Index<D> index) {
  if constexpr (kLoadsQuads<D>) {
    return GatherPair(d, table, index);
  } else {
    return {LookUpFloat(d, table, index), LookUpFloat(d, table + 1, index)};
  }
}
template <class D>
HWY_INLINE WordPair<D> LookUpWordPair(D d, const int32_t* HWY_RESTRICT table, Index<D> index) {
  if constexpr (kLoadsQuads<D>) {
    const IntPair<D> pair = GatherIntPair(d, table, index);
    return {pair.x, pair.y};
  } else {
    return {LookUpWord(d, table, index), LookUpWord(d, table + 1, index)};
  }
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
