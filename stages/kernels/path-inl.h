// How kernels read and write path state: gathers by slot, and stores to the lanes that a mask
// names.
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_KERNELS_PATH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_KERNELS_PATH_INL_H_
#undef CARPOOL_STAGES_KERNELS_PATH_INL_H_
#else
#define CARPOOL_STAGES_KERNELS_PATH_INL_H_
#endif

#include <cstring>

#ifdef CARPOOL_ONE_DOUBLE
#include "stages/kernels/path_double-inl.h"
#else
#include "stages/simd/lanes-inl.h"
#include "stages/simd/quads-inl.h"
#include "stages/tables/path.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// Up to one vector of slots; idle lanes repeat the last slot, so that reading them is harmless.
template <class D>
struct PathLanes {
  PathState* paths;
  Int<D> slot;
  Mask<D> active;
};

template <class D>
HWY_INLINE PathLanes<D> LoadSlots(D d, PathState* paths, const uint32_t* slots, size_t count) {
  const IntTag<D> di;
  constexpr size_t kLanes = hn::MaxLanes(D());
  if constexpr (kLanes == 1) {
    return {paths, hn::Set(di, static_cast<int32_t>(slots[0])), hn::FirstN(d, 1)};
  } else {
    if (count >= hn::Lanes(d)) {
      return {paths, hn::BitCast(di, hn::LoadU(UintTag<D>(), slots)), hn::FirstN(d, hn::Lanes(d))};
    }
    HWY_ALIGN uint32_t padded[kLanes];
    for (size_t i = 0; i < kLanes; ++i) padded[i] = slots[i < count ? i : count - 1];
    return {paths, hn::BitCast(di, hn::Load(UintTag<D>(), padded)), hn::FirstN(d, count)};
  }
}

template <class D>
HWY_INLINE Int<D> PathInt(D d, const PathLanes<D>& p, size_t offset) {
  return FieldInt<PathState>(d, p.paths, p.slot, offset);
}

/// Four neighbouring words, from a multiple of 16 bytes: one load per path and a transposition.
template <class D>
HWY_INLINE Quad<D> PathQuad(D d, const PathLanes<D>& p, size_t offset) {
  return FieldQuad(d, p.paths, p.slot, offset);
}

/// The lanes of a mask, as a list to loop over.
template <class D>
struct LaneList {
  static constexpr size_t kLanes = hn::MaxLanes(D());
  size_t count = 0;
  uint8_t lane[kLanes];
  PathState* path[kLanes];
};

template <class D>
HWY_INLINE LaneList<D> ListLanes(D d, const PathLanes<D>& p, Mask<D> mask) {
  LaneList<D> list;
  HWY_ALIGN int32_t slots[LaneList<D>::kLanes];
  hn::Store(p.slot, IntTag<D>(), slots);
  uint8_t bytes[(LaneList<D>::kLanes + 7) / 8 + 8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  uint64_t bits = 0;
  std::memcpy(&bits, bytes, 8);
  while (bits != 0) {
    const int lane = __builtin_ctzll(bits);
    bits &= bits - 1;
    list.lane[list.count] = static_cast<uint8_t>(lane);
    list.path[list.count++] = p.paths + slots[lane];
  }
  return list;
}

/// Writes word `offset / 4` of each listed path.
template <class D, class V>
HWY_INLINE void StoreWord(D d, const LaneList<D>& list, size_t offset, V value) {
  HWY_ALIGN float lanes[LaneList<D>::kLanes];
  hn::Store(hn::BitCast(d, value), d, lanes);
  for (size_t i = 0; i < list.count; ++i) {
    std::memcpy(reinterpret_cast<char*>(list.path[i]) + offset, &lanes[list.lane[i]], 4);
  }
}

/// Writes four neighbouring words, from a multiple of 16 bytes, of each listed path.
template <class D, class X, class Y, class Z, class W>
HWY_INLINE void StoreQuad(D d, const LaneList<D>& list, size_t offset, X x, Y y, Z z, W w) {
  constexpr size_t kLanes = LaneList<D>::kLanes;
  static_assert(kLanes == 1 || kLanes >= 4);
  HWY_ALIGN float words[4 * kLanes];
  if constexpr (kLanes >= 4) {
    hn::StoreInterleaved4(hn::BitCast(d, x), hn::BitCast(d, y), hn::BitCast(d, z),
                          hn::BitCast(d, w), d, words);
  } else {
    hn::Store(hn::BitCast(d, x), d, words);
    hn::Store(hn::BitCast(d, y), d, words + 1);
    hn::Store(hn::BitCast(d, z), d, words + 2);
    hn::Store(hn::BitCast(d, w), d, words + 3);
  }
  for (size_t i = 0; i < list.count; ++i) {
    std::memcpy(reinterpret_cast<char*>(list.path[i]) + offset, &words[4 * list.lane[i]], 16);
  }
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // CARPOOL_ONE_DOUBLE

#endif  // per-target include guard
