// The vocabulary of every SIMD kernel: small vectors over Highway lanes, gathers, guarded numerics.
//
// Per-target header: include it only from other -inl.h headers or from files that go through
// hwy/foreach_target.h. `D` is a Highway tag such as ScalableTag<float> or CappedTag<float, 1>; the
// same source at any width gives the same bits per lane, because every operation is lane-wise.

#if defined(CARPOOL_STAGES_SIMD_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARPOOL_STAGES_SIMD_LANES_INL_H_
#undef CARPOOL_STAGES_SIMD_LANES_INL_H_
#else
#define CARPOOL_STAGES_SIMD_LANES_INL_H_
#endif

#include <cmath>
#include <cstdint>

#ifdef CARPOOL_ONE_DOUBLE
#include "stages/simd/one_double.h"
#else
#include "hwy/highway.h"
#endif

HWY_BEFORE_NAMESPACE();
namespace carpool::stages::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Is this the reference in double? There, functions are as exact as the C library's.
#ifdef CARPOOL_ONE_DOUBLE
template <class D>
constexpr bool kReference = true;
#else
template <class D>
constexpr bool kReference = false;
#endif

template <class D>
using Real = hn::Vec<D>;  // one float (or double) per lane
template <class D>
using IntTag = hn::RebindToSigned<D>;
template <class D>
using UintTag = hn::RebindToUnsigned<D>;
template <class D>
using Int = hn::Vec<IntTag<D>>;
template <class D>
using Uint = hn::Vec<UintTag<D>>;
template <class D>
using Mask = hn::Mask<D>;

/// `value` in every lane. One lane is loaded, not broadcast: SSE4 would shuffle each constant.
template <class D>
HWY_INLINE hn::Vec<D> Broadcast(D d, hn::TFromD<D> value) {
  if constexpr (hn::MaxLanes(D()) == 1) {
    return hn::LoadU(d, &value);
  } else {
    return hn::Set(d, value);
  }
}
template <class D>
HWY_INLINE Real<D> Splat(D d, double value) {
  return Broadcast(d, static_cast<hn::TFromD<D>>(value));
}

/// Points, directions and RGB triples, one per lane.
template <class D>
struct Vec3 {
  Real<D> x, y, z;
};
template <class D>
struct Vec2 {
  Real<D> x, y;
};

template <class D>
HWY_INLINE Vec3<D> Splat3(D d, double x, double y, double z) {
  return {Splat(d, x), Splat(d, y), Splat(d, z)};
}
template <class D>
HWY_INLINE Vec3<D> Add(const Vec3<D>& a, const Vec3<D>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class D>
HWY_INLINE Vec3<D> Sub(const Vec3<D>& a, const Vec3<D>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class D>
HWY_INLINE Vec3<D> Mul(const Vec3<D>& a, const Vec3<D>& b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}
template <class D>
HWY_INLINE Vec3<D> Scale(const Vec3<D>& a, Real<D> s) {
  return {a.x * s, a.y * s, a.z * s};
}
/// a + s * b, fused.
template <class D>
HWY_INLINE Vec3<D> MulAdd(const Vec3<D>& b, Real<D> s, const Vec3<D>& a) {
  return {hn::MulAdd(b.x, s, a.x), hn::MulAdd(b.y, s, a.y), hn::MulAdd(b.z, s, a.z)};
}
template <class D>
HWY_INLINE Vec3<D> Neg(const Vec3<D>& a) {
  return {hn::Neg(a.x), hn::Neg(a.y), hn::Neg(a.z)};
}
template <class D>
HWY_INLINE Real<D> Dot(const Vec3<D>& a, const Vec3<D>& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, a.z * b.z));
}
/// a*b - c*d with one rounding error instead of catastrophic cancellation (Kahan).
template <class V>
HWY_INLINE V DifferenceOfProducts(V a, V b, V c, V d) {
  const V cd = c * d;
  const V difference = hn::MulSub(a, b, cd);
  const V error = hn::NegMulAdd(c, d, cd);
  return difference + error;
}
template <class D>
HWY_INLINE Vec3<D> Cross(const Vec3<D>& a, const Vec3<D>& b) {
  return {DifferenceOfProducts(a.y, b.z, a.z, b.y), DifferenceOfProducts(a.z, b.x, a.x, b.z),
          DifferenceOfProducts(a.x, b.y, a.y, b.x)};
}
template <class D>
HWY_INLINE Vec3<D> Select(Mask<D> m, const Vec3<D>& yes, const Vec3<D>& no) {
  return {hn::IfThenElse(m, yes.x, no.x), hn::IfThenElse(m, yes.y, no.y),
          hn::IfThenElse(m, yes.z, no.z)};
}
template <class D>
HWY_INLINE Real<D> MaxComponent(const Vec3<D>& a) {
  return hn::Max(a.x, hn::Max(a.y, a.z));
}
/// Rec.709 luminance of linear RGB.
template <class D>
HWY_INLINE Real<D> Luminance(D d, const Vec3<D>& c) {
  return hn::MulAdd(c.x, Splat(d, 0.2126),
                    hn::MulAdd(c.y, Splat(d, 0.7152), c.z * Splat(d, 0.0722)));
}

/// sqrt of a number that rounding may have pushed below zero: negative and NaN give 0.
template <class D>
HWY_INLINE Real<D> SafeSqrt(D d, Real<D> x) {
  return hn::Sqrt(hn::IfThenElseZero(hn::Gt(x, hn::Zero(d)), x));
}
/// a / b where b > 0, else 0 (also for NaN b).
template <class D>
HWY_INLINE Real<D> SafeDiv(D d, Real<D> a, Real<D> b) {
  const Mask<D> ok = hn::Gt(b, hn::Zero(d));
  return hn::IfThenElseZero(ok, a / hn::IfThenElse(ok, b, Splat(d, 1)));
}
/// A factor that brings x, which is normal and > 0 as is its inverse, into [1, 2): for floats a
/// power of two.
template <class D>
HWY_INLINE Real<D> ScaleToOne(D d, Real<D> x) {
  if constexpr (sizeof(hn::TFromD<D>) != 4) {
    return Splat(d, 1) / x;
  } else {
    const IntTag<D> di;
    const Int<D> exponent = hn::And(hn::BitCast(di, x), hn::Set(di, 0x7f800000));
    return hn::BitCast(d, hn::Set(di, 254 << 23) - exponent);
  }
}
/// a / |a|; a zero or non-finite length gives `fallback`. Scaled by the largest component first, so
/// that lengths from 1e-37 to 1e37 neither underflow nor overflow when squared.
template <class D>
HWY_INLINE Vec3<D> SafeNormalize(D d, const Vec3<D>& a, const Vec3<D>& fallback) {
  const Real<D> largest = hn::Max(hn::Abs(a.x), hn::Max(hn::Abs(a.y), hn::Abs(a.z)));
  Mask<D> ok = hn::And(hn::Gt(largest, Splat(d, 1e-37)), hn::Lt(largest, Splat(d, 1e37)));
  const Vec3<D> b = Scale(a, ScaleToOne(d, hn::IfThenElse(ok, largest, Splat(d, 1))));
  ok = hn::And(ok, hn::Gt(Dot(b, b), hn::Zero(d)));  // false for a NaN that Max let through
  const Real<D> inverse = Splat(d, 1) / hn::Sqrt(hn::IfThenElse(ok, Dot(b, b), Splat(d, 1)));
  return Select<D>(ok, Scale(b, inverse), fallback);
}
/// Normalises a vector known to be of ordinary length.
template <class D>
HWY_INLINE Vec3<D> Normalize(D d, const Vec3<D>& a) {
  return Scale(a, Splat(d, 1) / hn::Sqrt(Dot(a, a)));
}

/// log2 of a positive normal float, within 2e-5; exact for powers of two.
template <class D>
HWY_INLINE Real<D> FastLog2(D d, Real<D> x) {
  Real<D> exponent, t;
  if constexpr (kReference<D>) {
    int whole;
    t = hn::Set(d, 2 * std::frexp(hn::GetLane(x), &whole) - 1);
    exponent = hn::Set(d, whole - 1);
  } else {
    const IntTag<D> di;
    const Int<D> bits = hn::BitCast(di, x);
    exponent = hn::ConvertTo(d, hn::ShiftRight<23>(bits) - Broadcast(di, 127));
    const Int<D> mantissa =
        hn::Or(hn::And(bits, Broadcast(di, 0x7fffff)), Broadcast(di, 0x3f800000));
    t = hn::BitCast(d, mantissa) - Splat(d, 1);
  }
  Real<D> q = Splat(d, 0.0451482938);  // t * q(t) ~ log2(1 + t), q(1) = 1
  q = hn::MulAdd(q, t, Splat(d, -0.193573782));
  q = hn::MulAdd(q, t, Splat(d, 0.41560437));
  q = hn::MulAdd(q, t, Splat(d, -0.709095857));
  q = hn::MulAdd(q, t, Splat(d, 1.441916975));
  return hn::MulAdd(t, q, exponent);
}

/// Right-handed orthonormal basis around a unit vector (Duff et al. 2017, "Building an Orthonormal
/// Basis, Revisited", listing 3): stable at z = -1 and -0.
template <class D>
struct Frame {
  Vec3<D> t, b, n;
};
template <class D>
HWY_INLINE Frame<D> MakeFrame(D d, const Vec3<D>& n) {
  const Real<D> one = Splat(d, 1);
  const Real<D> sign = hn::CopySign(one, n.z);
  const Real<D> a = hn::Neg(one / (sign + n.z));
  const Real<D> b = n.x * n.y * a;
  return {{hn::MulAdd(sign * n.x * n.x, a, one), sign * b, hn::Neg(sign * n.x)},
          {b, hn::MulAdd(n.y * n.y, a, sign), hn::Neg(n.y)},
          n};
}
template <class D>
HWY_INLINE Vec3<D> ToLocal(const Frame<D>& f, const Vec3<D>& v) {
  return {Dot(v, f.t), Dot(v, f.b), Dot(v, f.n)};
}
template <class D>
HWY_INLINE Vec3<D> ToWorld(const Frame<D>& f, const Vec3<D>& v) {
  return MulAdd(f.t, v.x, MulAdd(f.b, v.y, Scale(f.n, v.z)));
}

/// Table look-ups: `index` counts elements; every lane's index must be in range (mask with
/// IfThenElse to 0 first). Use these, never hn::GatherIndex: below four lanes Highway's x86 gathers
/// read all four lanes of the register, unused ones at garbage addresses.
template <class D>
HWY_INLINE Real<D> GatherReal(D d, const float* HWY_RESTRICT base, Int<D> index) {
  if constexpr (hn::MaxLanes(D()) == 1) {
    return hn::LoadU(d, base + hn::GetLane(index));
  } else {
    return hn::GatherIndex(d, base, index);
  }
}
template <class D>
HWY_INLINE Int<D> GatherInt(D, const void* HWY_RESTRICT base, Int<D> index) {
  const IntTag<D> di;
  const int32_t* const words = static_cast<const int32_t*>(base);
  if constexpr (hn::MaxLanes(D()) == 1) {
    return hn::LoadU(di, words + hn::GetLane(index));
  } else {
    return hn::GatherIndex(di, words, index);
  }
}
template <class D>
HWY_INLINE Vec3<D> GatherVec3(D d, const float* HWY_RESTRICT base, Int<D> index) {
  const IntTag<D> di;
  return {GatherReal(d, base, index), GatherReal(d, base, index + hn::Set(di, 1)),
          GatherReal(d, base, index + hn::Set(di, 2))};
}
/// Field at byte offset `offset` of record `index` in an array of `Record`s: a float per lane.
template <class Record, class D>
HWY_INLINE Real<D> FieldReal(D d, const Record* HWY_RESTRICT base, Int<D> index, size_t offset) {
  static_assert(sizeof(Record) % 4 == 0);
  const IntTag<D> di;
  return GatherReal(d, reinterpret_cast<const float*>(base),
                    index * hn::Set(di, static_cast<int32_t>(sizeof(Record) / 4)) +
                        hn::Set(di, static_cast<int32_t>(offset / 4)));
}
template <class Record, class D>
HWY_INLINE Int<D> FieldInt(D d, const Record* HWY_RESTRICT base, Int<D> index, size_t offset) {
  static_assert(sizeof(Record) % 4 == 0);
  const IntTag<D> di;
  return GatherInt(d, base,
                   index * hn::Set(di, static_cast<int32_t>(sizeof(Record) / 4)) +
                       hn::Set(di, static_cast<int32_t>(offset / 4)));
}
template <class Record, class D>
HWY_INLINE Vec3<D> FieldVec3(D d, const Record* HWY_RESTRICT base, Int<D> index, size_t offset) {
  return {FieldReal(d, base, index, offset), FieldReal(d, base, index, offset + 4),
          FieldReal(d, base, index, offset + 8)};
}

/// One record of a table per lane. Queues are binned by what paths read, so that mostly all lanes
/// read the same record: then its fields are broadcast, which costs a load where a gather costs one
/// per lane.
template <class Record, class D>
struct Records {
  const Record* base;
  Int<D> index;        // valid in every lane
  const Record* same;  // the record of all lanes, or null if they differ
};
template <class Record, class D>
HWY_INLINE Records<Record, D> MakeRecords(D d, const Record* base, Int<D> index) {
  const Record* const first = base + hn::GetLane(index);
  if constexpr (hn::MaxLanes(D()) == 1) {
    return {base, index, first};
  } else {
    const IntTag<D> di;
    const bool same = hn::AllTrue(di, hn::Eq(index, hn::Set(di, hn::GetLane(index))));
    (void)d;
    return {base, index, same ? first : nullptr};
  }
}
template <class Record, class D>
HWY_INLINE Real<D> FieldReal(D d, const Records<Record, D>& records, size_t offset) {
  if (hn::MaxLanes(D()) == 1 || records.same != nullptr) {
    return hn::Set(
        d, *reinterpret_cast<const float*>(reinterpret_cast<const char*>(records.same) + offset));
  }
  return FieldReal(d, records.base, records.index, offset);
}
template <class Record, class D>
HWY_INLINE Int<D> FieldInt(D d, const Records<Record, D>& records, size_t offset) {
  if (hn::MaxLanes(D()) == 1 || records.same != nullptr) {
    return hn::Set(IntTag<D>(), *reinterpret_cast<const int32_t*>(
                                    reinterpret_cast<const char*>(records.same) + offset));
  }
  return FieldInt(d, records.base, records.index, offset);
}
template <class Record, class D>
HWY_INLINE Vec3<D> FieldVec3(D d, const Records<Record, D>& records, size_t offset) {
  return {FieldReal(d, records, offset), FieldReal(d, records, offset + 4),
          FieldReal(d, records, offset + 8)};
}

}  // namespace carpool::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
