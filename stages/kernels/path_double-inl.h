// How the kernels in double read and write their path: path-inl.h for the one lane of
// stages/simd/one_double.h.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "stages/simd/lanes-inl.h"
#include "stages/simd/quads-inl.h"
#include "stages/tables/path.h"
#include "stages/tables/reference_path.h"

namespace carpool::stages::HWY_NAMESPACE {

/// What kernels mean by a path, here.
using PathState = ReferencePath;

template <class D>
struct PathLanes {
  PathState* paths;
  Int<D> slot;
  Mask<D> active;
};

/// The one path at `path`.
template <class D>
inline PathLanes<D> OnlyPath(D d, PathState* path) {
  return {path, hn::Zero(IntTag<D>()), hn::FirstN(d, 1)};
}

template <class T>
inline T PathWord(const PathState* path, size_t offset) {
  T word;
  std::memcpy(&word, reinterpret_cast<const char*>(path) + offset, sizeof word);
  return word;
}
template <class D>
inline Real<D> PathReal(D, const PathLanes<D>& p, size_t offset) {
  return {PathWord<double>(p.paths, offset)};
}
template <class D>
inline Int<D> PathInt(D, const PathLanes<D>& p, size_t offset) {
  return {PathWord<int32_t>(p.paths, offset)};
}
template <class D>
inline Quad<D> PathQuad(D d, const PathLanes<D>& p, size_t offset) {
  return {PathReal(d, p, offset), PathReal(d, p, offset + 8), PathReal(d, p, offset + 16),
          PathReal(d, p, offset + 24)};
}

template <class D>
inline uint64_t LaneBits(D, Mask<D> mask) {
  return mask.v ? 1 : 0;
}

template <class D>
inline void StoreBytes(D, Mask<D> mask, Int<D> value, uint8_t* bytes) {
  if (mask.v) bytes[0] = static_cast<uint8_t>(value.v);
}

/// Where the lane is written: its path, or nowhere.
template <class D>
struct PathTargets {
  PathTargets(D, const PathLanes<D>& p, Mask<D> mask) : path(mask.v ? p.paths : nullptr) {}
  PathState* path;
};

/// The 8 bytes at `offset`; integers are extended by their sign.
template <class D, class T>
inline void StoreWord(D, const PathTargets<D>& to, size_t offset, hn::Lane<T> value) {
  if (to.path == nullptr) return;
  int64_t bits;
  if constexpr (std::is_floating_point_v<T>) {
    bits = std::bit_cast<int64_t>(value.v);
  } else {
    bits = static_cast<int64_t>(value.v);
  }
  std::memcpy(reinterpret_cast<char*>(to.path) + offset, &bits, sizeof bits);
}
template <class D, class X, class Y, class Z, class W>
inline void StoreQuad(D d, const PathTargets<D>& to, size_t offset, X x, Y y, Z z, W w) {
  StoreWord(d, to, offset, x);
  StoreWord(d, to, offset + 8, y);
  StoreWord(d, to, offset + 16, z);
  StoreWord(d, to, offset + 24, w);
}

}  // namespace carpool::stages::HWY_NAMESPACE
