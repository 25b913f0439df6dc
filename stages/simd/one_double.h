// Highway's vocabulary for one lane of double: with it the kernels become plain scalar C++, as a
// reference for their float selves.
//
// A translation unit that defines CARPOOL_ONE_DOUBLE before the kernels' headers gets this instead
// of Highway, under the same names, in a target namespace of its own. Reals are double, integers
// and words stay 32 bits wide, so random numbers and indices are the very same; tables stay float
// and are widened as they are read. No operation has side effects in lanes that are not there, so
// floating-point traps may be on.
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#define HWY_NAMESPACE N_DOUBLE
#define HWY_INLINE inline
#define HWY_NOINLINE [[gnu::noinline]]
#define HWY_RESTRICT __restrict__
#define HWY_ATTR
#define HWY_ALIGN alignas(16)
#define HWY_LANES(T) 1
#define HWY_BEFORE_NAMESPACE() static_assert(true)
#define HWY_AFTER_NAMESPACE() static_assert(true)

namespace hwy::HWY_NAMESPACE {

/// One lane of T, and one lane's truth.
template <class T>
struct Lane {
  T v;
};
struct Flag {
  bool v;
};

template <class Type>
struct Tag {
  using T = Type;
};
/// The kernels' D.
using OneDouble = Tag<double>;

template <class D>
using TFromD = typename D::T;
template <class D>
using Vec = Lane<TFromD<D>>;
template <class D>
using Mask = Flag;
template <class V>
using DFromV = Tag<decltype(V::v)>;
template <class T, class D>
using Rebind = Tag<T>;
template <class D>
using RebindToSigned = Tag<int32_t>;
template <class D>
using RebindToUnsigned = Tag<uint32_t>;

template <class D>
constexpr size_t MaxLanes(D) {
  return 1;
}
template <class D>
constexpr size_t Lanes(D) {
  return 1;
}

// Only wider vectors call these; templates that mention them need their names.
struct Never {
  template <class T>
  operator T() const;
};
template <class T, size_t N>
using FixedTag = Tag<T>;
template <class D>
using Half = D;
template <class... A>
Never Combine(A...);
template <class... A>
Never InterleaveLower(A...);
template <class... A>
Never InterleaveUpper(A...);
template <class... A>
Never GatherIndex(A...);
template <class... A>
void StoreInterleaved4(A...);

/// A float as double, whatever its bits: words that are no numbers may stand where reals are read
/// and must neither trap nor count.
inline double Widen(float x) {
  const bool nan = (std::bit_cast<uint32_t>(x) & 0x7fffffffu) > 0x7f800000u;
  return nan ? std::numeric_limits<double>::quiet_NaN() : static_cast<double>(x);
}

// Making, loading and storing.

template <class D, class X>
inline Vec<D> Set(D, X x) {
  return {static_cast<TFromD<D>>(x)};
}
inline Lane<double> Set(OneDouble, float x) {
  return {Widen(x)};
}
template <class D>
inline Vec<D> Zero(D) {
  return {TFromD<D>{}};
}
template <class D>
inline Vec<D> LoadU(D, const TFromD<D>* p) {
  return {*p};
}
inline Lane<double> LoadU(OneDouble, const float* p) {
  return {Widen(*p)};
}
inline Lane<int32_t> LoadU(Tag<int32_t>, const uint32_t* p) {
  return {static_cast<int32_t>(*p)};
}
template <class D>
inline Vec<D> Load(D, const TFromD<D>* p) {
  return {*p};
}
template <class T>
inline void Store(Lane<T> x, Tag<T>, T* p) {
  *p = x.v;
}
inline void Store(Lane<double> x, OneDouble, float* p) {
  *p = static_cast<float>(x.v);
}
template <class T>
inline void StoreU(Lane<T> x, Tag<T>, T* p) {
  *p = x.v;
}
template <class T>
inline T GetLane(Lane<T> x) {
  return x.v;
}
template <class T>
inline T ExtractLane(Lane<T> x, size_t) {
  return x.v;
}

// Arithmetic. Integers wrap around.

template <class T, class F>
inline Lane<T> Wrapping(Lane<T> a, Lane<T> b, F f) {
  if constexpr (std::is_floating_point_v<T>) {
    return {f(a.v, b.v)};
  } else {
    return {static_cast<T>(f(static_cast<uint32_t>(a.v), static_cast<uint32_t>(b.v)))};
  }
}
template <class T>
inline Lane<T> operator+(Lane<T> a, Lane<T> b) {
  return Wrapping(a, b, [](auto x, auto y) { return x + y; });
}
template <class T>
inline Lane<T> operator-(Lane<T> a, Lane<T> b) {
  return Wrapping(a, b, [](auto x, auto y) { return x - y; });
}
template <class T>
inline Lane<T> operator*(Lane<T> a, Lane<T> b) {
  return Wrapping(a, b, [](auto x, auto y) { return x * y; });
}
inline Lane<double> operator/(Lane<double> a, Lane<double> b) {
  return {a.v / b.v};
}
inline Lane<double> MulAdd(Lane<double> a, Lane<double> b, Lane<double> c) {
  return {std::fma(a.v, b.v, c.v)};
}
inline Lane<double> MulSub(Lane<double> a, Lane<double> b, Lane<double> c) {
  return {std::fma(a.v, b.v, -c.v)};
}
inline Lane<double> NegMulAdd(Lane<double> a, Lane<double> b, Lane<double> c) {
  return {std::fma(-a.v, b.v, c.v)};
}
template <class T>
inline Lane<T> Neg(Lane<T> a) {
  return {-a.v};
}
template <class T>
inline Lane<T> Abs(Lane<T> a) {
  return {std::abs(a.v)};
}
inline Lane<double> CopySign(Lane<double> a, Lane<double> sign) {
  return {std::copysign(a.v, sign.v)};
}
template <class T>
inline Lane<T> Min(Lane<T> a, Lane<T> b) {
  return a.v < b.v ? a : b;
}
template <class T>
inline Lane<T> Max(Lane<T> a, Lane<T> b) {
  return a.v > b.v ? a : b;
}
inline Lane<double> Sqrt(Lane<double> a) {
  return {std::sqrt(a.v)};
}
inline Lane<double> Floor(Lane<double> a) {
  return {std::floor(a.v)};
}
inline Lane<double> Round(Lane<double> a) {
  return {std::nearbyint(a.v)};
}
inline Lane<double> Sin(OneDouble, Lane<double> a) {
  return {std::sin(a.v)};
}
inline Lane<double> Cos(OneDouble, Lane<double> a) {
  return {std::cos(a.v)};
}
inline Lane<double> Atan(OneDouble, Lane<double> a) {
  return {std::atan(a.v)};
}

// Conversions. What does not fit an integer is brought to its nearest.

inline int32_t Saturated(double x) {
  constexpr double kLow = std::numeric_limits<int32_t>::min();
  constexpr double kHigh = std::numeric_limits<int32_t>::max();
  if (std::isnan(x)) return 0;
  return static_cast<int32_t>(std::fmin(std::fmax(x, kLow), kHigh));
}
inline Lane<double> ConvertTo(OneDouble, Lane<int32_t> a) {
  return {static_cast<double>(a.v)};
}
inline Lane<int32_t> ConvertTo(Tag<int32_t>, Lane<double> a) {
  return {Saturated(a.v)};
}
inline Lane<int32_t> DemoteTo(Tag<int32_t>, Lane<double> a) {
  return {Saturated(a.v)};
}
inline Lane<int32_t> NearestInt(Lane<double> a) {
  return {Saturated(std::nearbyint(a.v))};
}
inline Lane<double> PromoteTo(OneDouble, Lane<int32_t> a) {
  return {static_cast<double>(a.v)};
}
inline Lane<double> PromoteTo(OneDouble, Lane<float> a) {
  return {Widen(a.v)};
}

/// Between types of 32 bits as ever. A word that stands in the place of a double has the low half
/// of its bits.
template <class D, class T>
inline Vec<D> BitCast(D, Lane<T> a) {
  using To = TFromD<D>;
  if constexpr (sizeof(To) == sizeof(T)) {
    return {std::bit_cast<To>(a.v)};
  } else if constexpr (sizeof(To) < sizeof(T)) {
    return {std::bit_cast<To>(static_cast<uint32_t>(std::bit_cast<uint64_t>(a.v)))};
  } else {
    return {std::bit_cast<To>(static_cast<uint64_t>(std::bit_cast<uint32_t>(a.v)))};
  }
}

// Bits of integers, and truth.

template <class T>
inline Lane<T> And(Lane<T> a, Lane<T> b) {
  return {a.v & b.v};
}
template <class T>
inline Lane<T> Or(Lane<T> a, Lane<T> b) {
  return {a.v | b.v};
}
template <class T>
inline Lane<T> Xor(Lane<T> a, Lane<T> b) {
  return {a.v ^ b.v};
}
template <class T>
inline Lane<T> operator^(Lane<T> a, Lane<T> b) {
  return {a.v ^ b.v};
}
template <class T>
inline Lane<T> Not(Lane<T> a) {
  return {~a.v};
}
template <class T>
inline Lane<T> AndNot(Lane<T> a, Lane<T> b) {
  return {~a.v & b.v};
}
template <int kBits, class T>
inline Lane<T> ShiftLeft(Lane<T> a) {
  return {static_cast<T>(static_cast<uint32_t>(a.v) << kBits)};
}
template <int kBits, class T>
inline Lane<T> ShiftRight(Lane<T> a) {
  return {a.v >> kBits};
}
template <class T>
inline Lane<T> ShiftRightSame(Lane<T> a, int bits) {
  return {a.v >> bits};
}
template <class T>
inline Flag TestBit(Lane<T> a, Lane<T> bit) {
  return {(a.v & bit.v) != 0};
}
inline Flag And(Flag a, Flag b) {
  return {a.v && b.v};
}
inline Flag Or(Flag a, Flag b) {
  return {a.v || b.v};
}
inline Flag Not(Flag a) {
  return {!a.v};
}
inline Flag AndNot(Flag a, Flag b) {
  return {!a.v && b.v};
}
template <class T>
inline Flag Eq(Lane<T> a, Lane<T> b) {
  return {a.v == b.v};
}
template <class T>
inline Flag Ne(Lane<T> a, Lane<T> b) {
  return {a.v != b.v};
}
template <class T>
inline Flag Lt(Lane<T> a, Lane<T> b) {
  return {a.v < b.v};
}
template <class T>
inline Flag Le(Lane<T> a, Lane<T> b) {
  return {a.v <= b.v};
}
template <class T>
inline Flag Gt(Lane<T> a, Lane<T> b) {
  return {a.v > b.v};
}
template <class T>
inline Flag Ge(Lane<T> a, Lane<T> b) {
  return {a.v >= b.v};
}
template <class D>
inline Flag RebindMask(D, Flag m) {
  return m;
}
template <class D>
inline Flag FirstN(D, size_t n) {
  return {n > 0};
}
template <class D>
inline bool AllFalse(D, Flag m) {
  return !m.v;
}
template <class D>
inline bool AllTrue(D, Flag m) {
  return m.v;
}
template <class D>
inline intptr_t FindFirstTrue(D, Flag m) {
  return m.v ? 0 : -1;
}
template <class T>
inline Lane<T> IfThenElse(Flag m, Lane<T> yes, Lane<T> no) {
  return m.v ? yes : no;
}
template <class T>
inline Lane<T> IfThenElseZero(Flag m, Lane<T> yes) {
  return m.v ? yes : Lane<T>{};
}
template <class T>
inline Lane<T> IfThenZeroElse(Flag m, Lane<T> no) {
  return m.v ? Lane<T>{} : no;
}

// The bytes of a word, for tables of 16 bytes.

struct Bytes {
  uint8_t v[4];
};
struct ByteTag {
  using T = uint8_t;
};
template <class T, class D>
using Repartition = ByteTag;
template <class T, size_t N>
using CappedTag = ByteTag;
inline const uint8_t* LoadDup128(ByteTag, const uint8_t* table) {
  return table;
}
inline Bytes BitCast(ByteTag, Lane<uint32_t> a) {
  return std::bit_cast<Bytes>(a.v);
}
inline Lane<uint32_t> BitCast(Tag<uint32_t>, Bytes a) {
  return {std::bit_cast<uint32_t>(a)};
}
inline Bytes Or(Bytes a, Bytes b) {
  for (size_t i = 0; i < 4; ++i) a.v[i] = static_cast<uint8_t>(a.v[i] | b.v[i]);
  return a;
}
inline Bytes TableLookupBytes(const uint8_t* table, Bytes index) {
  return {{table[index.v[0]], table[index.v[1]], table[index.v[2]], table[index.v[3]]}};
}
inline Bytes TableLookupBytes(Bytes bytes, const uint8_t* index) {
  return {{bytes.v[index[0]], bytes.v[index[1]], bytes.v[index[2]], bytes.v[index[3]]}};
}

}  // namespace hwy::HWY_NAMESPACE
