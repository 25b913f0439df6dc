// Turns the film's sums into what people look at: means, standard errors and a measure of noise.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/film/accumulator.h"

namespace carpool::render {

/// RGB of every pixel, rows from the top, 3 floats a pixel.
using RgbPlane = std::vector<float>;

/// Mean over all samples of each pixel; pixels without a sample are 0.
RgbPlane ResolveBeauty(const stages::FilmAccumulator& film);

/// Like ResolveBeauty, but a pixel without a sample takes the nearest one of its 16x16 tile that
/// has some: a picture of an interleaved subset.
RgbPlane ResolvePreview(const stages::FilmAccumulator& film);

/// Standard error of each pixel's mean. It comes from the four scrambles' means, whose variance is
/// pooled over tiles of 8x8 pixels: alone, a pixel's three degrees of freedom would say little. 0
/// where fewer than two scrambles have samples, which is where it is unknown.
RgbPlane ResolveStandardError(const stages::FilmAccumulator& film);

/// Relative noise of the image: over tiles of 8x8 pixels, the mean of (pooled standard error of a
/// pixel's luminance) / (mean luminance of the tile + 1 % of the image's). Negative where it is
/// unknown.
double EstimateNoise(const stages::FilmAccumulator& film);

}  // namespace carpool::render
