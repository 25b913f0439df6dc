// The pixel filter as an inverse cumulative distribution, for filter importance sampling.
#pragma once

#include <array>

namespace carpool::stages {

/// Blackman-Harris window of this radius in pixels, along each axis: positive everywhere, so every
/// sample has weight 1.
constexpr double kPixelFilterRadius = 1.5;
constexpr int kPixelFilterCells = 256;

/// Knot k is the offset in pixels below which k/256 of the filter's mass lies. Between knots the
/// offset is linear, so the filter in force is the window averaged over cells of equal mass; that
/// filter is sampled exactly. Behind the last knot are two numbers more: kernels load four at once.
using PixelFilterKnots = std::array<float, kPixelFilterCells + 1 + 2>;
extern const PixelFilterKnots kPixelFilterKnots;

}  // namespace carpool::stages
