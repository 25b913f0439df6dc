// Says which types may travel through a graph as items, and fixes their alignment.
#pragma once

#include <cstddef>
#include <type_traits>

namespace carpool {

/// Every block of items begins on a boundary of this many bytes, so that a kernel may use aligned
/// vector loads on the start of a batch, and two workers never write to one cache line.
inline constexpr std::size_t kItemAlignment = 64;

/// Item is a type that may travel through a graph: it is copied with memcpy and never destroyed.
template <class T>
concept Item = std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T> &&
               alignof(T) <= kItemAlignment;

namespace detail {

// Gives the advice once, wherever a type is first named (a failed concept alone would only say no).
template <class T>
constexpr void require_item() {
  static_assert(
      std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>,
      "carpool: items are moved in blocks with memcpy, so they must be trivially copyable. "
      "Keep the object in a table of yours and emit its index, or emit a small plain record.");
  static_assert(alignof(T) <= kItemAlignment,
                "carpool: items are aligned to at most 64 bytes. Emit an index to the over-aligned "
                "object instead.");
}

}  // namespace detail
}  // namespace carpool
