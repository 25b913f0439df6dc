// Fetches four neighbouring words of one record per lane, by loading records and transposing
// registers.
//
// A gather of N lanes reads N words by N addresses; four of them read the same cache lines four
// times. From four lanes up, loading each record's 16 bytes and transposing blocks of 4x4 costs
// about a third (Zen 4).
//
// Per-target header: see stages/simd/lanes-inl.h.

#if defined(CARPOOL_STAGES_SIMD_QUADS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_SIMD_QUADS_INL_H_
#undef CARPOOL_STAGES_SIMD_QUADS_INL_H_
#else
#define CARPOOL_STAGES_SIMD_QUADS_INL_H_
#endif

#include "stages/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {

/// Words 0..3 of a record, one record per lane.
template <class D>
struct Quad {
  Real<D> x, y, z, w;
};

/// One 16-byte block per record `base[index[4 k]]`, k = 0, 1, ...: as many as the vector has
/// blocks.
template <class D>
HWY_INLINE Real<D> LoadBlocks(D d, const float* HWY_RESTRICT base, const int32_t* index) {
  if constexpr (hn::MaxLanes(D()) == 4) {
    return hn::LoadU(d, base + index[0]);
  } else {
    const hn::Half<D> half;
    constexpr size_t kHalf = hn::MaxLanes(hn::Half<D>());
    return hn::Combine(d, LoadBlocks(half, base, index + kHalf), LoadBlocks(half, base, index));
  }
}

/// base[at[k]], ... base[at[k] + 3] for lane k of four or more.
template <class D>
HWY_INLINE Quad<D> LoadQuad(D d, const float* HWY_RESTRICT base, const int32_t* at) {
  // Block k of `a` is the record of lane 4 k, of `b` that of lane 4 k + 1, and so on.
  const Real<D> a = LoadBlocks(d, base, at), b = LoadBlocks(d, base, at + 1),
                c = LoadBlocks(d, base, at + 2), e = LoadBlocks(d, base, at + 3);
  const Real<D> ac_low = hn::InterleaveLower(d, a, c), be_low = hn::InterleaveLower(d, b, e);
  const Real<D> ac_high = hn::InterleaveUpper(d, a, c), be_high = hn::InterleaveUpper(d, b, e);
  return {hn::InterleaveLower(d, ac_low, be_low), hn::InterleaveUpper(d, ac_low, be_low),
          hn::InterleaveLower(d, ac_high, be_high), hn::InterleaveUpper(d, ac_high, be_high)};
}

/// base[index], base[index + 1], ... base[index + 3]; `index` counts floats. All four must be
/// readable in every lane.
template <class D>
HWY_INLINE Quad<D> GatherQuad(D d, const float* HWY_RESTRICT base, Int<D> index) {
  const IntTag<D> di;
  if constexpr (hn::MaxLanes(D()) < 4) {
    const auto word = [&](int32_t k)
                          HWY_ATTR { return GatherReal(d, base, index + hn::Set(di, k)); };
    return {word(0), word(1), word(2), word(3)};
  } else {
    HWY_ALIGN int32_t at[hn::MaxLanes(D())];
    hn::Store(index, di, at);
    return LoadQuad(d, base, at);
  }
}

/// Words 0..7 of a record, one record per lane.
template <class D>
struct Oct {
  Quad<D> low, high;
};
/// base[index], ... base[index + 7], as GatherQuad.
template <class D>
HWY_INLINE Oct<D> GatherOct(D d, const float* HWY_RESTRICT base, Int<D> index) {
  if constexpr (hn::MaxLanes(D()) < 4) {
    return {GatherQuad(d, base, index), GatherQuad(d, base + 4, index)};
  } else {
    HWY_ALIGN int32_t at[hn::MaxLanes(D())];
    hn::Store(index, IntTag<D>(), at);
    return {LoadQuad(d, base, at), LoadQuad(d, base + 4, at)};
  }
}

/// Four integers per lane.
template <class D>
struct IntQuad {
  Int<D> x, y, z, w;
};

/// base[index], ... base[index + 3]; `index` counts words. All four must be readable in every lane.
/// They travel as the bits of floats, which loads and shuffles leave alone.
template <class D>
HWY_INLINE IntQuad<D> GatherIntQuad(D d, const void* HWY_RESTRICT base, Int<D> index) {
  const IntTag<D> di;
  if constexpr (hn::MaxLanes(D()) < 4) {
    const auto word = [&](int32_t k)
                          HWY_ATTR { return GatherInt(d, base, index + hn::Set(di, k)); };
    return {word(0), word(1), word(2), word(3)};
  } else {
    const Quad<D> q = GatherQuad(d, static_cast<const float*>(base), index);
    return {hn::BitCast(di, q.x), hn::BitCast(di, q.y), hn::BitCast(di, q.z), hn::BitCast(di, q.w)};
  }
}

/// Two integers per lane: base[index] and base[index + 1]. Reads two words more where lanes are
/// four or more.
template <class D>
struct IntPair {
  Int<D> x, y;
};
template <class D>
HWY_INLINE IntPair<D> GatherIntPair(D d, const void* HWY_RESTRICT base, Int<D> index) {
  if constexpr (hn::MaxLanes(D()) < 4) {
    return {GatherInt(d, base, index), GatherInt(d, base, index + hn::Set(IntTag<D>(), 1))};
  } else {
    const IntQuad<D> q = GatherIntQuad(d, base, index);
    return {q.x, q.y};
  }
}

/// base[index], base[index + 1], base[index + 2]. Reads one float more where lanes are four or
/// more.
template <class D>
HWY_INLINE Vec3<D> GatherTriple(D d, const float* HWY_RESTRICT base, Int<D> index) {
  if constexpr (hn::MaxLanes(D()) < 4) {
    return GatherVec3(d, base, index);
  } else {
    const Quad<D> q = GatherQuad(d, base, index);
    return {q.x, q.y, q.z};
  }
}
/// base[index], base[index + 1]. Reads two floats more where lanes are four or more.
template <class D>
HWY_INLINE Vec2<D> GatherPair(D d, const float* HWY_RESTRICT base, Int<D> index) {
  if constexpr (hn::MaxLanes(D()) < 4) {
    return {GatherReal(d, base, index), GatherReal(d, base, index + hn::Set(IntTag<D>(), 1))};
  } else {
    const Quad<D> q = GatherQuad(d, base, index);
    return {q.x, q.y};
  }
}

/// The four floats from byte `offset` of record `index` in an array of `Record`s.
template <class Record, class D>
HWY_INLINE Quad<D> FieldQuad(D d, const Record* HWY_RESTRICT base, Int<D> index, size_t offset) {
  static_assert(sizeof(Record) % 4 == 0);
  const IntTag<D> di;
  return GatherQuad(d, reinterpret_cast<const float*>(base) + offset / 4,
                    index * hn::Set(di, static_cast<int32_t>(sizeof(Record) / 4)));
}

/// The three floats from byte `offset` of each lane's record; with a neighbour, where that saves
/// loads.
template <class Record, class D>
HWY_INLINE Vec3<D> FieldTriple(D d, const Records<Record, D>& records, size_t offset) {
  if (hn::MaxLanes(D()) < 4 || records.same != nullptr) return FieldVec3(d, records, offset);
  if (offset + 16 <= sizeof(Record)) {
    const Quad<D> q = FieldQuad(d, records.base, records.index, offset);
    return {q.x, q.y, q.z};
  }
  const Quad<D> q = FieldQuad(d, records.base, records.index, offset - 4);
  return {q.y, q.z, q.w};
}

/// The four integers from byte `offset` of record `index`.
template <class Record, class D>
HWY_INLINE IntQuad<D> FieldIntQuad(D d, const Record* HWY_RESTRICT base, Int<D> index,
                                   size_t offset) {
  static_assert(sizeof(Record) % 4 == 0);
  const IntTag<D> di;
  return GatherIntQuad(d, reinterpret_cast<const int32_t*>(base) + offset / 4,
                       index * hn::Set(di, static_cast<int32_t>(sizeof(Record) / 4)));
}

/// The integer in word `word`, from byte `offset`, of a quad that was loaded from there. Where a
/// float is widened as it is loaded, the record is read again.
template <class Record, class D>
HWY_INLINE Int<D> QuadInt(D d, const Record* base, Int<D> index, size_t offset, Real<D> word) {
  if constexpr (kReference<D>) {
    return FieldInt(d, base, index, offset);
  } else {
    return hn::BitCast(IntTag<D>(), word);
  }
}

/// The float whose bits these are.
template <class D>
HWY_INLINE Real<D> RealOfBits(D d, Int<D> bits) {
  if constexpr (kReference<D>) {
    return hn::PromoteTo(d, hn::BitCast(hn::Rebind<float, D>(), bits));
  } else {
    return hn::BitCast(d, bits);
  }
}
/// The lower and the upper 16 bits, which are signed.
template <class D>
HWY_INLINE Real<D> LowerHalf(D d, Int<D> bits) {
  return hn::ConvertTo(d, hn::ShiftRight<16>(hn::ShiftLeft<16>(bits)));
}
template <class D>
HWY_INLINE Real<D> UpperHalf(D d, Int<D> bits) {
  return hn::ConvertTo(d, hn::ShiftRight<16>(bits));
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
