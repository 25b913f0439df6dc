// From a packet size that is known at run time to code that is compiled for it.
#pragma once

#include <type_traits>

namespace carpool::stages {

/// `by_size(std::integral_constant<int, N>)` for the N among 4, 8 and 16 that `size` is.
template <class BySize>
void WithPacketSize(int size, const BySize& by_size) {
  if (size == 16) return by_size(std::integral_constant<int, 16>());
  if (size == 8) return by_size(std::integral_constant<int, 8>());
  by_size(std::integral_constant<int, 4>());
}

}  // namespace carpool::stages
