// The film's exact sums: fixed point conversion, carries, atomic adds.
#include "stages/film/accumulator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "stages/mutants.h"

namespace carpool::stages {
namespace {

// Relaxed order is enough: a sum's value does not depend on order, and readers come after a join.
template <class T>
T FetchAdd(T& cell, T value) {
  return std::atomic_ref<T>(cell).fetch_add(value, std::memory_order_relaxed);
}

/// What a film of floats would keep.
void RoundToFloat(FilmSum& sum) {
  for (size_t c = 0; c < 3; ++c) {
    const __int128 exact = sum.Quanta(c);
    const auto rounded = static_cast<__int128>(static_cast<float>(exact));
    sum.low[c] = static_cast<uint64_t>(rounded);
    sum.AddToRest(c, static_cast<int64_t>((rounded >> 64) - (exact >> 64)));
  }
}

}  // namespace

FilmAccumulator::FilmAccumulator(uint32_t width, uint32_t height, const FilmPlanes& planes,
                                 float clamp)
    : width_(width),
      height_(height),
      planes_(planes),
      clamp_(clamp),
      largest_(std::min(clamp, static_cast<float>(kFilmLargest))),
      locks_(width) {
  const size_t count = size_t{width} * height;
  pixels_.resize(count);
  if (planes.albedo) albedo_.resize(count * 3);
  if (planes.normal) normal_.resize(count * 3);
  if (planes.depth) depth_.assign(count, std::numeric_limits<float>::infinity());
  if (planes.object) object_.resize(count);
  if (planes.material) material_.resize(count);
}

uint64_t FilmAccumulator::bytes() const {
  return pixels_.size() * sizeof(FilmPixel) + wraps_.size() * sizeof(uint32_t) +
         (albedo_.size() + normal_.size()) * sizeof(int64_t) +
         (depth_.size() + object_.size() + material_.size()) * sizeof(uint32_t);
}

void FilmAccumulator::Enter(SampleFault fault, uint32_t pixel, uint32_t sample) {
  Fault& entry = faults_[static_cast<size_t>(fault)];
  FetchAdd(entry.count, uint64_t{1});
  const uint64_t place = uint64_t{sample} << 32 | pixel;
  std::atomic_ref<uint64_t> first(entry.first);
  uint64_t seen = first.load(std::memory_order_relaxed);
  while (place < seen && !first.compare_exchange_weak(seen, place, std::memory_order_relaxed)) {
  }
}

/// Makes a sample one that can be added, and says so in the ledger.
void FilmAccumulator::Mend(uint32_t pixel, uint32_t sample, double channels[3]) {
  bool not_finite = false, too_large = false, negative = false;
  double brightest = 0;
  for (int c = 0; c < 3; ++c) {
    double& value = channels[c];
    if (!std::isfinite(value)) {
      not_finite = true;
      value = 0;
    }
    if (std::abs(value) > kFilmLargest) {
      too_large = true;
      value = std::copysign(kFilmLargest, value);
    }
    negative = negative || value < 0;
    brightest = std::max(brightest, value);
  }
  const bool clamped = brightest > clamp_;
  Enter(not_finite  ? SampleFault::not_finite
        : too_large ? SampleFault::too_large
        : negative  ? SampleFault::negative
                    : SampleFault::clamped,
        pixel, sample);
  if (!clamped) return;
  const std::lock_guard lock(clamp_mutex_);
  for (int c = 0; c < 3; ++c) {
    const double kept = channels[c] * (clamp_ / brightest);
    removed_[c] += ToFixed(channels[c]) - ToFixed(kept);
    channels[c] = kept;
  }
}

/// Adds a sample of any kind.
void FilmAccumulator::AddOther(uint32_t pixel, uint32_t sample, const float radiance[3]) {
  double channels[3] = {radiance[0], radiance[1], radiance[2]};
  if (!IsPlain(radiance)) {
    if (IsMutant(Mutant::rejected_nan)) return;
    Mend(pixel, sample, channels);
  }
  FilmSum& sum = pixels_[pixel][sample % kScrambles];
  for (size_t c = 0; c < 3; ++c) sum.Add(c, ToFixed(channels[c]));
  if (sum.Count()) NoteWrap(pixel, sum);
  if (IsMutant(Mutant::float_film)) RoundToFloat(sum);
}

/// After 2^16 samples of one scramble, which few renders have, the pixel needs a longer count.
void FilmAccumulator::NoteWrap(uint32_t pixel, const FilmSum& sum) {
  if (sum.Samples() != 0) return;
  std::call_once(has_wraps_, [&] { wraps_.resize(pixels_.size()); });
  ++wraps_[pixel];  // under the pixel's lock
}

SampleLedger FilmAccumulator::Ledger() const {
  SampleLedger ledger;
  for (int i = 0; i < kSampleFaults; ++i) {
    const Fault& fault = faults_[static_cast<size_t>(i)];
    if (fault.count == 0) continue;
    ledger.entries[static_cast<size_t>(i)] = {fault.count, static_cast<uint32_t>(fault.first),
                                              static_cast<uint32_t>(fault.first >> 32)};
  }
  if (ledger.Of(SampleFault::clamped).count == 0) return ledger;
  constexpr double kLuminance[3] = {0.2126, 0.7152, 0.0722};
  for (int c = 0; c < 3; ++c) {
    double sum = 0;
    for (uint32_t pixel = 0; pixel < pixels_.size(); ++pixel) {
      for (int g = 0; g < kScrambles; ++g) sum += Sum(pixel, g, c);
    }
    const double removed = static_cast<double>(removed_[c]) * kFilmQuantum;
    ledger.removed_energy += kLuminance[c] * removed;
    ledger.energy += kLuminance[c] * (sum + removed);
  }
  return ledger;
}

void FilmAccumulator::AddFirstHit(uint32_t pixel, uint32_t sample, const FirstHit& hit) {
  const size_t base = size_t{pixel} * 3;
  for (int c = 0; c < 3; ++c) {
    if (planes_.albedo) FetchAdd(albedo_[base + c], ToFixed(hit.albedo[c]));
    if (planes_.normal) FetchAdd(normal_[base + c], ToFixed(hit.normal[c]));
  }
  if (sample != 0) return;  // one writer per pixel from here
  if (planes_.depth) depth_[pixel] = hit.depth;
  if (planes_.object) object_[pixel] = hit.object;
  if (planes_.material) material_[pixel] = hit.material;
}

double FilmAccumulator::Sum(uint32_t pixel, int scramble, int channel) const {
  const FilmSum& sum = pixels_[pixel][static_cast<size_t>(scramble)];
  return static_cast<double>(sum.Quanta(static_cast<size_t>(channel))) * kFilmQuantum;
}

namespace {
void MeanOf(const std::vector<int64_t>& sums, uint32_t pixel, uint32_t samples, double out[3]) {
  for (int c = 0; c < 3; ++c) {
    out[c] = samples == 0
                 ? 0
                 : static_cast<double>(sums[size_t{pixel} * 3 + c]) * kFilmQuantum / samples;
  }
}
}  // namespace

void FilmAccumulator::Albedo(uint32_t pixel, double rgb[3]) const {
  MeanOf(albedo_, pixel, Samples(pixel), rgb);
}

void FilmAccumulator::Normal(uint32_t pixel, double xyz[3]) const {
  MeanOf(normal_, pixel, Samples(pixel), xyz);
}

}  // namespace carpool::stages
