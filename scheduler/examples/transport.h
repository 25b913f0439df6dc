// Neutral particles through a layered slab: the physics, and three ways to run it, which find
// exactly the same tallies, because every random number is a pure function of (particle, event).
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <utility>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>
#include <tbb/task_arena.h>

#include "carpool/carpool.h"

namespace transport {

struct Layer {
  double end;         // depth at which it ends, in mean free paths of a unit cross-section
  double sigma;       // total cross-section
  double scattering;  // probability that a collision scatters
};

struct Particle {
  double depth;
  double cosine;  // of the direction, against the depth axis
  std::uint32_t id;
  std::uint32_t event;  // random numbers used so far
};

struct alignas(64) Tally {
  std::uint64_t reflected = 0;
  std::uint64_t transmitted = 0;
  std::uint64_t absorbed = 0;
  std::uint64_t collisions = 0;
  bool operator==(const Tally&) const = default;
  Tally& operator+=(const Tally& other) {
    reflected += other.reflected;
    transmitted += other.transmitted;
    absorbed += other.absorbed;
    collisions += other.collisions;
    return *this;
  }
};

// random is uniform in (0, 1): a hash of who asks, and of how often they have asked.
inline double random(Particle& particle) {
  std::uint64_t x = (std::uint64_t{particle.id} << 32 | particle.event++) + 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  x ^= x >> 31;
  return (static_cast<double>(x >> 11) + 0.5) * 0x1p-53;
}

enum class Event { collide, cross, reflect, transmit };

class Slab {
 public:
  explicit Slab(std::vector<Layer> layers) : layers_(std::move(layers)) {}

  std::uint32_t layers() const { return static_cast<std::uint32_t>(layers_.size()); }

  static Particle born(std::uint32_t id) { return {.depth = 0, .cosine = 1, .id = id, .event = 0}; }

  // fly moves a particle to its collision, or over the border to the next layer, which it sets.
  Event fly(Particle& particle, std::uint32_t& layer) const {
    const double begin = layer == 0 ? 0.0 : layers_[layer - 1].end;
    const double flight = -std::log(random(particle)) / layers_[layer].sigma * particle.cosine;
    const double to = particle.depth + flight;
    if (to < begin) {
      particle.depth = begin;
      return layer == 0 ? Event::reflect : (--layer, Event::cross);
    }
    if (to > layers_[layer].end) {
      particle.depth = layers_[layer].end;
      return layer + 1 == layers() ? Event::transmit : (++layer, Event::cross);
    }
    particle.depth = to;
    return Event::collide;
  }

  // survives decides a collision, and turns the particle into a random direction.
  bool survives(Particle& particle, std::uint32_t layer) const {
    if (random(particle) >= layers_[layer].scattering) {
      return false;
    }
    particle.cosine = 2 * random(particle) - 1;
    return true;
  }

 private:
  std::vector<Layer> layers_;
};

// The history-based loop: one particle after the other, to its end.
inline Tally by_history(const Slab& slab, std::uint32_t first, std::uint32_t last) {
  Tally tally;
  for (std::uint32_t id = first; id < last; ++id) {
    Particle particle = Slab::born(id);
    std::uint32_t layer = 0;
    for (bool alive = true; alive;) {
      switch (slab.fly(particle, layer)) {
        case Event::collide:
          ++tally.collisions;
          alive = slab.survives(particle, layer);
          tally.absorbed += alive ? 0 : 1;
          break;
        case Event::cross:
          break;
        case Event::reflect:
          ++tally.reflected;
          alive = false;
          break;
        case Event::transmit:
          ++tally.transmitted;
          alive = false;
          break;
      }
    }
  }
  return tally;
}

// The same loop on several threads, as one would write it with oneTBB alone.
inline Tally by_history_parallel(const Slab& slab, std::uint32_t count, std::uint32_t threads) {
  tbb::task_arena arena(threads == 0 ? tbb::task_arena::automatic : static_cast<int>(threads));
  return arena.execute([&] {
    return tbb::parallel_reduce(
        tbb::blocked_range<std::uint32_t>(0, count, 1024), Tally{},
        [&](const auto& range, Tally sum) {
          sum += by_history(slab, range.begin(), range.end());
          return sum;
        },
        [](Tally a, const Tally& b) {
          a += b;
          return a;
        });
  });
}

// The event-based version: the same functions, as a graph of two stages.
inline Tally by_event(const Slab& slab, std::uint32_t count, std::uint32_t threads,
                      bool print_report) {
  std::vector<Tally> tallies(4096);
  carpool::Graph graph;
  const auto fly = graph.add_stage<Particle>({.name = "fly", .bins = slab.layers()});
  const auto collide =
      graph.add_stage<Particle>({.name = "collide", .bins = slab.layers(), .rank = 1});
  graph.set_kernel(fly, [&](const carpool::Batch<Particle>& batch, carpool::Emitter& out) {
    Tally& tally = tallies[batch.worker];
    for (Particle particle : batch.items) {
      std::uint32_t layer = batch.bin;
      switch (slab.fly(particle, layer)) {
        case Event::collide:
          out.emit(collide, layer, particle);
          break;
        case Event::cross:
          out.emit(fly, layer, particle);
          break;
        case Event::reflect:
          ++tally.reflected;
          break;
        case Event::transmit:
          ++tally.transmitted;
          break;
      }
    }
  });
  graph.set_kernel(collide, [&](const carpool::Batch<Particle>& batch, carpool::Emitter& out) {
    Tally& tally = tallies[batch.worker];
    for (Particle particle : batch.items) {
      ++tally.collisions;
      if (slab.survives(particle, batch.bin)) {
        out.emit(fly, batch.bin, particle);
      } else {
        ++tally.absorbed;
      }
    }
  });
  std::atomic<std::uint32_t> next{0};
  const auto beam = graph.add_source(
      {.name = "beam", .concurrency = 0}, [&](carpool::SourceContext& ctx, carpool::Emitter& out) {
        const std::uint32_t first = next.fetch_add(ctx.budget);
        for (std::uint32_t id = first; id < std::min(count, first + ctx.budget); ++id) {
          out.emit(fly, 0, Slab::born(id));
        }
        return first + ctx.budget < count ? carpool::SourceStatus::more
                                          : carpool::SourceStatus::exhausted;
      });
  graph.add_edge(beam, fly);
  graph.add_edge(fly, fly);
  graph.add_edge(fly, collide);
  graph.add_edge(collide, fly);
  const carpool::RunReport report = carpool::run(graph, {.threads = threads, .in_flight = 32768});
  if (print_report) {
    std::fputs(report.to_json().c_str(), stderr);
  }
  Tally sum;
  for (const Tally& tally : tallies) {
    sum += tally;
  }
  return sum;
}

}  // namespace transport
