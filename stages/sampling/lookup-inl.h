// Table look-ups by index for the samplers and BSDF tables, safe at one lane.
//
// Highway's gathers read all lanes of a 128-bit register even when the tag has one, so that unused lanes
// would address memory at random; one lane therefore loads a scalar. Per-target header: see
// stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_SAMPLING_LOOKUP_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_SAMPLING_LOOKUP_INL_H_
#undef CARPOOL_STAGES_SAMPLING_LOOKUP_INL_H_
#else
#define CARPOOL_STAGES_SAMPLING_LOOKUP_INL_H_
#endif

#include <cstdint>

#include "stages/simd/lanes-inl.h"

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

/// table[index] as D's lanes; every index must be in range.
template <class D>
HWY_INLINE Real<D> LookUpFloat(D d, const float* HWY_RESTRICT table, Index<D> index) {
  if constexpr (hn::MaxLanes(d) == 1) {
    return Splat(d, table[hn::GetLane(index)]);
  } else {
    const auto values = hn::GatherIndex(hn::Rebind<float, D>(), table, index);
    if constexpr (sizeof(hn::TFromD<D>) == 4) {
      return values;
    } else {
      return hn::PromoteTo(d, values);
    }
  }
}
template <class D>
HWY_INLINE Index<D> LookUpWord(D d, const int32_t* HWY_RESTRICT table, Index<D> index) {
  const IndexTag<D> di;
  if constexpr (hn::MaxLanes(d) == 1) {
    return hn::Set(di, table[hn::GetLane(index)]);
  } else {
    return hn::GatherIndex(di, table, index);
  }
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
