// Two films side by side: the renderer's, and what one would write who does not mind the order.
#include "tools/bench/film_price.h"

#include <tbb/parallel_for.h>

#include <chrono>
#include <vector>

#include "stages/executors/camera_work.h"
#include "stages/film/accumulator.h"
#include "tools/bench/rows.h"

namespace carpool::tools {
namespace {

using stages::CameraPacket;
using stages::CameraWork;
using stages::kScrambles;

constexpr uint32_t kSamples = 16;
constexpr int kRounds = 5;

/// Per pixel and scramble a sum of floats; one cache line. Locks like the exact film.
class FloatFilm {
 public:
  FloatFilm(uint32_t width, uint32_t height) : locks_(width), pixels_(size_t{width} * height) {}

  void Add(uint32_t pixel, uint32_t sample, const float radiance[3]) {
    const uint32_t lock = locks_.Of(pixel);
    locks_.Lock(lock);
    Pixel& p = pixels_[pixel];
    float* const sums = p.sums + sample % kScrambles * 3;
    for (int c = 0; c < 3; ++c) sums[c] += radiance[c];
    ++p.samples;
    locks_.Unlock(lock);
  }

 private:
  struct alignas(64) Pixel {
    float sums[kScrambles * 3] = {};
    uint32_t samples = 0;
  };
  stages::TileLocks locks_;
  stages::HugeVector<Pixel> pixels_;
};

/// Nanoseconds of one thread per sample; the values differ from sample to sample, as radiance does.
template <class Film>
double TimeAdding(Film& film, uint32_t width, uint32_t height, tbb::task_arena& arena) {
  const auto threads = static_cast<uint32_t>(arena.max_concurrency());
  CameraWork work(width, height, {.sample_count = kSamples}, threads);
  const auto add = [&](const CameraPacket& packet) {
    for (uint32_t i = 0; i < 8; ++i) {
      const uint32_t x = packet.x + i % stages::kGroupWidth, y = packet.y + i / stages::kGroupWidth;
      if (x >= width || y >= height) continue;
      const float value = 1.0f / static_cast<float>(1 + (x ^ y) + packet.sample);
      const float radiance[3] = {value, 0.7f * value, 0.3f * value};
      film.Add(y * width + x, packet.sample, radiance);
    }
  };
  const auto begin = std::chrono::steady_clock::now();
  arena.execute([&] {
    tbb::parallel_for(uint32_t{0}, threads, [&](uint32_t worker) {
      while (work.Claim(worker, stages::kClaim, add)) {
      }
    });
  });
  const std::chrono::duration<double, std::nano> took = std::chrono::steady_clock::now() - begin;
  return took.count() * threads / (double{kSamples} * width * height);
}

}  // namespace

FilmPrice MeasureFilmPrice(uint32_t width, uint32_t height, tbb::task_arena& arena) {
  stages::FilmAccumulator exact(width, height, {});
  FloatFilm floats(width, height);
  std::vector<double> exact_times, float_times;
  for (int round = 0; round < kRounds + 1; ++round) {
    const double a = TimeAdding(exact, width, height, arena);
    const double b = TimeAdding(floats, width, height, arena);
    if (round == 0) continue;  // pages come into being
    exact_times.push_back(a);
    float_times.push_back(b);
  }
  return {Median(exact_times), Median(float_times)};
}

}  // namespace carpool::tools
