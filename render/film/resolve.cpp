// Means and errors from exact sums, tiles in parallel.
#include "render/film/resolve.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace carpool::render {
namespace {

using stages::FilmAccumulator;
using stages::kScrambles;

constexpr uint32_t kPool = 8;  // pixels along the side of a tile whose variances are pooled
using Triple = std::array<double, 3>;

uint32_t ScrambleSamples(uint32_t samples, int scramble) {
  return (samples + kScrambles - 1 - static_cast<uint32_t>(scramble)) / kScrambles;
}

/// What a pixel has gathered, read once: the film's sums are 128-bit integers, which take a while
/// to become numbers.
struct PixelSums {
  PixelSums(const FilmAccumulator& film, uint32_t pixel) : samples(film.Samples(pixel)) {
    for (int g = 0; g < kScrambles; ++g) {
      for (int c = 0; c < 3; ++c) of_scramble[g][c] = film.Sum(pixel, g, c);
    }
  }
  uint32_t samples;
  std::array<Triple, kScrambles> of_scramble;
};

Triple MeanOf(const PixelSums& sums) {
  Triple mean = {};
  for (int c = 0; c < 3 && sums.samples > 0; ++c) {
    for (const Triple& sum : sums.of_scramble) mean[c] += sum[c];
    mean[c] /= sums.samples;
  }
  return mean;
}
Triple MeanOf(const FilmAccumulator& film, uint32_t pixel) {
  return MeanOf(PixelSums(film, pixel));
}

double LuminanceOf(const Triple& rgb) {
  return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

/// Variance of a pixel's mean, per channel and of its luminance, from the spread of the scrambles.
struct PixelVariance {
  Triple channel = {};
  double luminance = 0;
  bool known = false;
};

PixelVariance VarianceOf(const PixelSums& sums, const Triple& mean) {
  const uint32_t n = sums.samples;
  PixelVariance variance;
  if (n < 2) return variance;
  int groups = 0;
  for (int g = 0; g < kScrambles; ++g) {
    const uint32_t count = ScrambleSamples(n, g);
    if (count == 0) continue;
    ++groups;
    Triple difference;
    for (int c = 0; c < 3; ++c) difference[c] = sums.of_scramble[g][c] / count - mean[c];
    const double weight = static_cast<double>(count) / n;
    for (int c = 0; c < 3; ++c) variance.channel[c] += weight * difference[c] * difference[c];
    const double luminance = LuminanceOf(difference);
    variance.luminance += weight * luminance * luminance;
  }
  for (double& v : variance.channel) v /= groups - 1;
  variance.luminance /= groups - 1;
  variance.known = true;
  return variance;
}

struct Tile {
  uint32_t x0, y0, x1, y1;
};

template <class Visit>
void ForTiles(const FilmAccumulator& film, Visit visit, uint32_t side = kPool) {
  const uint32_t across = (film.width() + side - 1) / side;
  const uint32_t down = (film.height() + side - 1) / side;
  tbb::parallel_for(uint32_t{0}, across * down, [&](uint32_t i) {
    const uint32_t x = i % across * side, y = i / across * side;
    visit(i, Tile{x, y, std::min(x + side, film.width()), std::min(y + side, film.height())});
  });
}

uint32_t TileCount(const FilmAccumulator& film) {
  return ((film.width() + kPool - 1) / kPool) * ((film.height() + kPool - 1) / kPool);
}

template <class Visit>
void ForPixels(const FilmAccumulator& film, const Tile& tile, Visit visit) {
  for (uint32_t y = tile.y0; y < tile.y1; ++y) {
    for (uint32_t x = tile.x0; x < tile.x1; ++x) visit(y * film.width() + x);
  }
}

void Store(RgbPlane& plane, uint32_t pixel, const Triple& value) {
  for (int c = 0; c < 3; ++c) plane[size_t{pixel} * 3 + c] = static_cast<float>(value[c]);
}

}  // namespace

RgbPlane ResolveBeauty(const FilmAccumulator& film) {
  RgbPlane plane(size_t{film.width()} * film.height() * 3);
  ForTiles(film, [&](uint32_t, const Tile& tile) {
    ForPixels(film, tile, [&](uint32_t pixel) { Store(plane, pixel, MeanOf(film, pixel)); });
  });
  return plane;
}

RgbPlane ResolvePreview(const FilmAccumulator& film) {
  constexpr uint32_t kSide = 16;  // of a tile in which every phase of a preview has pixels
  RgbPlane plane(size_t{film.width()} * film.height() * 3);
  ForTiles(
      film,
      [&](uint32_t, const Tile& tile) {
        struct Sampled {
          int x, y;
          Triple mean;
        };
        std::vector<Sampled> sampled;
        ForPixels(film, tile, [&](uint32_t pixel) {
          if (film.Samples(pixel) == 0) return;
          sampled.push_back({static_cast<int>(pixel % film.width()),
                             static_cast<int>(pixel / film.width()), MeanOf(film, pixel)});
        });
        if (sampled.empty()) return;
        ForPixels(film, tile, [&](uint32_t pixel) {
          const int x = static_cast<int>(pixel % film.width()),
                    y = static_cast<int>(pixel / film.width());
          const auto distance = [&](const Sampled& s) {
            return (s.x - x) * (s.x - x) + (s.y - y) * (s.y - y);
          };
          const auto nearest = std::min_element(
              sampled.begin(), sampled.end(),
              [&](const Sampled& a, const Sampled& b) { return distance(a) < distance(b); });
          Store(plane, pixel, nearest->mean);
        });
      },
      kSide);
  return plane;
}

RgbPlane ResolveStandardError(const FilmAccumulator& film) {
  RgbPlane plane(size_t{film.width()} * film.height() * 3);
  ForTiles(film, [&](uint32_t, const Tile& tile) {
    Triple pooled = {};
    uint32_t known = 0;
    ForPixels(film, tile, [&](uint32_t pixel) {
      const PixelSums sums(film, pixel);
      const PixelVariance v = VarianceOf(sums, MeanOf(sums));
      known += v.known ? 1 : 0;
      for (int c = 0; c < 3; ++c) pooled[c] += v.channel[c];
    });
    for (double& value : pooled) value = known == 0 ? 0 : std::sqrt(value / known);
    ForPixels(film, tile, [&](uint32_t pixel) { Store(plane, pixel, pooled); });
  });
  return plane;
}

double EstimateNoise(const FilmAccumulator& film) {
  struct Noise {
    double error = 0, luminance = 0;
    uint32_t known = 0;
  };
  std::vector<Noise> tiles(TileCount(film));
  ForTiles(film, [&](uint32_t i, const Tile& tile) {
    Noise noise;
    uint32_t pixels = 0;
    ForPixels(film, tile, [&](uint32_t pixel) {
      const PixelSums sums(film, pixel);
      const Triple mean = MeanOf(sums);
      const PixelVariance v = VarianceOf(sums, mean);
      noise.error += v.luminance;
      noise.known += v.known ? 1 : 0;
      noise.luminance += LuminanceOf(mean);
      ++pixels;
    });
    noise.error = noise.known == 0 ? 0 : std::sqrt(noise.error / noise.known);
    noise.luminance /= pixels;
    tiles[i] = noise;
  });
  double image = 0, sum = 0;
  uint32_t known = 0;
  for (const Noise& tile : tiles) image += tile.luminance / static_cast<double>(tiles.size());
  for (const Noise& tile : tiles) {
    if (tile.known == 0) continue;
    ++known;
    const double reference = tile.luminance + 0.01 * image;
    if (reference > 0) sum += tile.error / reference;
  }
  return known == 0 ? -1 : sum / known;
}

}  // namespace carpool::render
