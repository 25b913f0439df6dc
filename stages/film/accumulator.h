// The film while rendering: exact integer sums per pixel, so that samples may arrive in any order.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

namespace carpool::stages {

constexpr int kScrambles = 4;             // samples belong by index to four independent scrambles
constexpr double kFilmQuantum = 0x1p-32;  // cd/m2 (or the file's unit) of the lowest bit
constexpr double kFilmLargest = 0x1p30;   // larger channels are clamped and counted: 2^62 quanta

/// Per pixel and scramble, RGB sums in 80-bit fixed point: range +-2^47 at quantum 2^-32, hence no
/// overflow while samples per scramble x mean < 2^47. 128 bytes.
struct alignas(64) FilmPixel {
  uint64_t low[kScrambles * 3];
  int16_t high[kScrambles * 3];
  uint32_t samples;   // below 2^31: the top bit is a lock while a sample is being added
  uint32_t rejected;  // samples that were not finite (counted as 0) or were clamped to the range
};
static_assert(sizeof(FilmPixel) == 128);

/// Which optional planes the plan asked for.
struct FilmPlanes {
  bool albedo = false;
  bool normal = false;
  bool depth = false;
  bool object = false;
  bool material = false;
};

/// What the first hit of a sample shows, for the AOVs.
struct FirstHit {
  float albedo[3];
  float normal[3];
  float depth;
  uint32_t object;
  uint32_t material;
};

/// Thread safe: any number of threads may add at once; sums do not depend on the order. Reading is
/// exact only while no thread adds.
class FilmAccumulator {
 public:
  FilmAccumulator(uint32_t width, uint32_t height, const FilmPlanes& planes);

  uint32_t width() const { return width_; }
  uint32_t height() const { return height_; }
  const FilmPlanes& planes() const { return planes_; }
  uint64_t bytes() const;

  /// Adds one sample of `pixel` (y * width + x). Non-finite channels count as 0, oversized ones as
  /// the largest; either is counted in `rejected`.
  void Add(uint32_t pixel, uint32_t sample, const float radiance[3]);
  /// Asks for the pixel's cache lines ahead of Add.
  void Prefetch(uint32_t pixel) const {
    __builtin_prefetch(&pixels_[pixel], 1);
    __builtin_prefetch(&pixels_[pixel].high, 1);
  }

  /// Adds what sample `sample` of `pixel` saw first; ids and depth are kept of sample 0 alone.
  void AddFirstHit(uint32_t pixel, uint32_t sample, const FirstHit& hit);

  uint32_t Samples(uint32_t pixel) const { return pixels_[pixel].samples; }
  uint32_t Rejected(uint32_t pixel) const { return pixels_[pixel].rejected; }
  /// Sum of one channel over the samples of one scramble.
  double Sum(uint32_t pixel, int scramble, int channel) const;
  void Albedo(uint32_t pixel, double rgb[3]) const;  // mean over the samples
  void Normal(uint32_t pixel, double xyz[3]) const;
  float Depth(uint32_t pixel) const {
    return depth_[pixel];
  }  // metres; infinity where nothing was hit
  uint32_t Object(uint32_t pixel) const { return object_[pixel]; }
  uint32_t Material(uint32_t pixel) const { return material_[pixel]; }

 private:
  uint32_t width_, height_;
  FilmPlanes planes_;
  std::vector<FilmPixel> pixels_;
  std::vector<int64_t> albedo_, normal_;  // 3 per pixel, quantum 2^-32
  std::vector<float> depth_;
  std::vector<uint32_t> object_, material_;
};

}  // namespace carpool::stages
