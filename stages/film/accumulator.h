// The film while rendering: exact integer sums per pixel, so that samples may arrive in any order.
#pragma once

#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <mutex>
#include <vector>

#include "stages/film/tile_locks.h"
#include "stages/mutants.h"
#include "stages/tables/huge_pages.h"

namespace carpool::stages {

constexpr int kScrambles = 4;             // samples belong by index to four independent scrambles
constexpr double kFilmQuantum = 0x1p-32;  // cd/m2 (or the file's unit) of the lowest bit
constexpr double kFilmLargest = 0x1p30;   // larger channels are clamped and counted: 2^62 quanta

/// The samples of one pixel and scramble: their RGB sums in 80-bit fixed point, range +-2^47 at
/// quantum 2^-32, hence no overflow while samples x mean < 2^47; and their number modulo 2^16. Half
/// a cache line.
struct alignas(32) FilmSum {
  uint64_t low[3];  // the sums modulo 2^64
  uint64_t rest;    // R + 2^16 G + 2^32 B + 2^48 samples, where R, G, B are what `low` leaves out

  /// Adds quanta to one channel.
  void Add(size_t channel, int64_t quanta) {
    const uint64_t old = low[channel];
    low[channel] = old + static_cast<uint64_t>(quanta);
    AddToRest(channel, (low[channel] < old ? 1 : 0) - (quanta < 0 ? 1 : 0));
  }
  /// Adds 2^64 quanta `times` times.
  void AddToRest(size_t channel, int64_t times) {
    rest += static_cast<uint64_t>(times) << (16 * channel);
  }
  /// One sample more; true if their number may have become 0 by it.
  bool Count() {
    rest += uint64_t{1} << 48;
    return (((rest >> 48) + 1) & 0xffff) <= 1;  // a negative sum below takes 1 from what is seen
  }

  uint32_t Samples() const { return static_cast<uint16_t>(Digit(3)); }
  __int128 Quanta(size_t channel) const {
    return (static_cast<__int128>(Digit(channel)) << 64) + low[channel];
  }

 private:
  /// One of the four parts of `rest`. They are signed, so those below must be taken off first.
  int16_t Digit(size_t part) const {
    uint64_t above = rest;
    for (size_t i = 0; i < part; ++i)
      above = (above - static_cast<uint64_t>(static_cast<int16_t>(above))) >> 16;
    return static_cast<int16_t>(above);
  }
};
using FilmPixel = std::array<FilmSum, kScrambles>;
static_assert(sizeof(FilmPixel) == 128);

/// Why a sample went into the ledger. Each sample is entered once, under the first that holds.
enum class SampleFault : uint8_t {
  not_finite,  // a channel was NaN or infinite, and counts as 0
  too_large,   // a channel was beyond kFilmLargest, and counts as that
  negative,    // a channel was below 0; it is added as it is
  clamped,     // the brightest channel was above the user's clamp: all were scaled down to it
};
constexpr int kSampleFaults = 4;

/// Samples that were not taken as they came, by cause; the first of each is the one with the least
/// (sample, pixel), whatever the order in which they came.
struct SampleLedger {
  struct Entry {
    uint64_t count = 0;
    uint32_t pixel = 0, sample = 0;  // of the first
  };
  std::array<Entry, kSampleFaults> entries;
  double removed_energy = 0;  // what the clamp took of the luminance of all samples, summed ...
  double energy = 0;          // ... which was this before; 0 where nothing was taken

  const Entry& Of(SampleFault fault) const { return entries[static_cast<size_t>(fault)]; }
  uint64_t Count() const {
    uint64_t count = 0;
    for (const Entry& entry : entries) count += entry.count;
    return count;
  }
};

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
  /// `clamp`: the brightest channel that a sample may have; infinity: no clamp.
  FilmAccumulator(uint32_t width, uint32_t height, const FilmPlanes& planes,
                  float clamp = std::numeric_limits<float>::infinity());

  uint32_t width() const { return width_; }
  uint32_t height() const { return height_; }
  const FilmPlanes& planes() const { return planes_; }
  uint64_t bytes() const;

  /// Adds samples, and keeps the pixels' lock for as long as they share one: neighbours in turn are
  /// cheap. A thread may have one Writer at a time; others wait meanwhile.
  class Writer {
   public:
    explicit Writer(FilmAccumulator& film) : film_(film) {}
    ~Writer() { Release(); }
    Writer(const Writer&) = delete;
    Writer& operator=(const Writer&) = delete;

    /// Adds one sample of `pixel` (y * width + x). What cannot be added as it is, is entered in the
    /// ledger.
    void Add(uint32_t pixel, uint32_t sample, const float radiance[3]) {
      const uint32_t lock = film_.locks_.Of(pixel);
      if (lock != held_) {
        Release();
        film_.locks_.Lock(lock);
        held_ = lock;
      }
      film_.AddLocked(pixel, sample, radiance);
    }

   private:
    static constexpr uint32_t kNoLock = ~0u;
    void Release() {
      if (held_ != kNoLock) film_.locks_.Unlock(held_);
    }

    FilmAccumulator& film_;
    uint32_t held_ = kNoLock;
  };
  void Add(uint32_t pixel, uint32_t sample, const float radiance[3]) {
    Writer(*this).Add(pixel, sample, radiance);
  }
  /// Asks for the cache line that Add will need.
  void Prefetch(uint32_t pixel, uint32_t sample) const {
    __builtin_prefetch(&pixels_[pixel][sample % kScrambles], 1);
  }

  /// Adds what sample `sample` of `pixel` saw first; ids and depth are kept of sample 0 alone.
  void AddFirstHit(uint32_t pixel, uint32_t sample, const FirstHit& hit);

  uint32_t Samples(uint32_t pixel) const {
    uint32_t samples = 0;
    for (const FilmSum& sum : pixels_[pixel]) samples += sum.Samples();
    return wraps_.empty() ? samples : samples + (wraps_[pixel] << 16);
  }
  /// What was entered so far; sums over the film, so not cheap.
  SampleLedger Ledger() const;
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
  struct Fault {
    uint64_t count = 0;
    uint64_t first = ~uint64_t{0};  // sample, then pixel
  };

  void AddLocked(uint32_t pixel, uint32_t sample, const float radiance[3]) {
    if (IsMutant(Mutant::float_film) || !IsPlain(radiance))
      return AddOther(pixel, sample, radiance);
    FilmSum& sum = pixels_[pixel][sample % kScrambles];
    for (size_t c = 0; c < 3; ++c) sum.Add(c, ToFixed(radiance[c]));
    if (sum.Count()) NoteWrap(pixel, sum);
  }
  /// Can the sample be added as it is, and is nothing of it negative?
  bool IsPlain(const float radiance[3]) const {
    bool plain = true;
    for (int c = 0; c < 3; ++c) plain &= radiance[c] >= 0 && radiance[c] <= largest_;  // not NaN
    return plain;
  }
  static int64_t ToFixed(double value) { return std::llrint(value * (1 / kFilmQuantum)); }
  void AddOther(uint32_t pixel, uint32_t sample, const float radiance[3]);
  void NoteWrap(uint32_t pixel, const FilmSum& sum);
  void Enter(SampleFault fault, uint32_t pixel, uint32_t sample);
  void Mend(uint32_t pixel, uint32_t sample, double channels[3]);

  uint32_t width_, height_;
  FilmPlanes planes_;
  float clamp_, largest_;  // largest_: channels up to here are added as they are
  TileLocks locks_;
  std::array<Fault, kSampleFaults> faults_;
  std::mutex clamp_mutex_;
  __int128 removed_[3] = {0, 0, 0};  // by the clamp, in quanta
  HugeVector<FilmPixel> pixels_;
  std::once_flag has_wraps_;
  std::vector<uint32_t> wraps_;  // how often a pixel's counts became 0; empty until one does
  std::vector<int64_t> albedo_, normal_;  // 3 per pixel, quantum 2^-32
  std::vector<float> depth_;
  std::vector<uint32_t> object_, material_;
};

}  // namespace carpool::stages
