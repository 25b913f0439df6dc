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

/// Bit k: lane k.
template <class D>
HWY_INLINE uint64_t LaneBits(D d, Mask<D> mask) {
  uint8_t bytes[(hn::MaxLanes(D()) + 7) / 8 + 8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  uint64_t bits = 0;
  std::memcpy(&bits, bytes, 8);
  return bits;
}

/// bytes[k] = the lowest byte of lane k, 0..255, for each lane k of the mask.
template <class D>
HWY_INLINE void StoreBytes(D d, Mask<D> mask, Int<D> values, uint8_t* bytes) {
  constexpr size_t kLanes = hn::MaxLanes(D());
  if constexpr (kLanes > 1) {
    if (hn::AllTrue(d, mask)) {
      const hn::Rebind<uint8_t, D> db;
      return hn::StoreU(hn::DemoteTo(db, values), db, bytes);
    }
  }
  HWY_ALIGN int32_t words[kLanes];
  hn::Store(values, IntTag<D>(), words);
  for (uint64_t bits = LaneBits(d, mask); bits != 0; bits &= bits - 1) {
    const int lane = __builtin_ctzll(bits);
    bytes[lane] = static_cast<uint8_t>(words[lane]);
  }
}

/// Where lanes are written: each lane of the mask to its path, the others to a record that nobody
/// reads, so that stores need no branches. Stays where it was made.
template <class D>
class PathTargets {
 public:
  static constexpr size_t kLanes = hn::MaxLanes(D());

  HWY_INLINE PathTargets(D d, const PathLanes<D>& p, Mask<D> mask) {
    HWY_ALIGN int32_t slots[kLanes];
    hn::Store(p.slot, IntTag<D>(), slots);
    for (size_t i = 0; i < kLanes; ++i) path_[i] = p.paths + slots[i];
    if (hn::AllTrue(d, mask)) return;
    const uint64_t bits = LaneBits(d, mask);
    for (size_t i = 0; i < kLanes; ++i) path_[i] = (bits >> i & 1) != 0 ? path_[i] : &unread_;
  }
  PathTargets(const PathTargets&) = delete;
  PathTargets& operator=(const PathTargets&) = delete;

  HWY_INLINE float* Word(size_t lane, size_t offset) const {
    return reinterpret_cast<float*>(reinterpret_cast<char*>(path_[lane]) + offset);
  }

 private:
  PathState* path_[kLanes];
  PathState unread_;
};

/// Writes word `offset / 4` of each target.
template <class D, class V>
HWY_INLINE void StoreWord(D d, const PathTargets<D>& to, size_t offset, V value) {
  constexpr size_t kLanes = PathTargets<D>::kLanes;
  HWY_ALIGN float lanes[kLanes];
  hn::Store(hn::BitCast(d, value), d, lanes);
  for (size_t i = 0; i < kLanes; ++i) std::memcpy(to.Word(i, offset), &lanes[i], 4);
}

/// Writes the vector's blocks of 16 bytes to targets `lane`, `lane` + 4, ...
template <class D, class DV>
HWY_INLINE void StoreBlocks(DV dv, hn::Vec<DV> v, const PathTargets<D>& to, size_t lane,
                            size_t offset) {
  if constexpr (hn::MaxLanes(DV()) == 4) {
    hn::StoreU(v, dv, to.Word(lane, offset));
  } else {
    const hn::Half<DV> half;
    StoreBlocks<D>(half, hn::LowerHalf(half, v), to, lane, offset);
    StoreBlocks<D>(half, hn::UpperHalf(half, v), to, lane + hn::MaxLanes(DV()) / 2, offset);
  }
}

/// Writes four neighbouring words, from a multiple of 16 bytes, of each target.
template <class D, class X, class Y, class Z, class W>
HWY_INLINE void StoreQuad(D d, const PathTargets<D>& to, size_t offset, X x, Y y, Z z, W w) {
  static_assert(PathTargets<D>::kLanes == 1 || PathTargets<D>::kLanes >= 4);
  const Real<D> a = hn::BitCast(d, x), b = hn::BitCast(d, y), c = hn::BitCast(d, z),
                e = hn::BitCast(d, w);
  if constexpr (PathTargets<D>::kLanes >= 4) {
    const Real<D> ac_low = hn::InterleaveLower(d, a, c), be_low = hn::InterleaveLower(d, b, e);
    const Real<D> ac_high = hn::InterleaveUpper(d, a, c), be_high = hn::InterleaveUpper(d, b, e);
    StoreBlocks<D>(d, hn::InterleaveLower(d, ac_low, be_low), to, 0, offset);
    StoreBlocks<D>(d, hn::InterleaveUpper(d, ac_low, be_low), to, 1, offset);
    StoreBlocks<D>(d, hn::InterleaveLower(d, ac_high, be_high), to, 2, offset);
    StoreBlocks<D>(d, hn::InterleaveUpper(d, ac_high, be_high), to, 3, offset);
  } else {
    float* const words = to.Word(0, offset);
    words[0] = hn::GetLane(a);
    words[1] = hn::GetLane(b);
    words[2] = hn::GetLane(c);
    words[3] = hn::GetLane(e);
  }
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // CARPOOL_ONE_DOUBLE

#endif  // per-target include guard
