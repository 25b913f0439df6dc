// Neutral particles through a layered slab: the physics, and three ways to run it, which find
// exactly the same tallies, because every random number is a pure function of (particle, event).
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <span>
#include <utility>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>
#include <tbb/task_arena.h>

#include "carpool/carpool.h"

namespace transport {

inline constexpr std::uint32_t kBlock = 256;  // particles in a batch, at most

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

// Medium is a layer that knows where it begins.
struct Medium : Layer {
  double begin;

  // survives decides a collision, and turns the particle into a random direction.
  bool survives(Particle& particle) const {
    if (random(particle) >= scattering) {
      return false;
    }
    particle.cosine = 2 * random(particle) - 1;
    return true;
  }

  // fly moves a particle to its collision (0), or to the border before it, beyond which lies the
  // next layer (1) or the one before (-1).
  int fly(Particle& particle) const {
    const double to = destination(particle);
    if (to < begin) {
      particle.depth = begin;
      return -1;
    }
    if (to > end) {
      particle.depth = end;
      return 1;
    }
    particle.depth = to;
    return 0;
  }

  // The same two for many particles that do not wait for each other: an outcome is data, not a
  // branch that nobody could foresee.
  bool survives_without_branch(Particle& particle) const {
    const double chance = random(particle);
    particle.cosine = 2 * random(particle) - 1;
    return chance < scattering;
  }
  int fly_without_branch(Particle& particle) const {
    const double to = destination(particle);
    particle.depth = std::min(std::max(to, begin), end);
    return static_cast<int>(to > end) - static_cast<int>(to < begin);
  }

 private:
  double destination(Particle& particle) const {
    return particle.depth + -std::log(random(particle)) / sigma * particle.cosine;
  }
};

class Slab {
 public:
  explicit Slab(const std::vector<Layer>& layers) {
    double begin = 0;
    for (const Layer& layer : layers) {
      media_.push_back({layer, std::exchange(begin, layer.end)});
    }
  }

  std::uint32_t layers() const { return static_cast<std::uint32_t>(media_.size()); }
  const Medium& medium(std::uint32_t layer) const { return media_[layer]; }

  static Particle born(std::uint32_t id) { return {.depth = 0, .cosine = 1, .id = id, .event = 0}; }

 private:
  std::vector<Medium> media_;
};

// The history-based loop: one particle after the other, to its end.
inline Tally by_history(const Slab& slab, std::uint32_t first, std::uint32_t last) {
  Tally tally;
  for (std::uint32_t id = first; id < last; ++id) {
    Particle particle = Slab::born(id);
    std::uint32_t layer = 0;
    for (bool alive = true; alive;) {
      const int step = slab.medium(layer).fly(particle);
      if (step == 0) {
        ++tally.collisions;
        alive = slab.medium(layer).survives(particle);
        tally.absorbed += alive ? 0 : 1;
        continue;
      }
      layer += static_cast<std::uint32_t>(step);  // below the first comes the largest number
      if (layer >= slab.layers()) {
        ++(step < 0 ? tally.reflected : tally.transmitted);
        alive = false;
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

// Where the particles of a batch go: back, on, or to a collision where they are; or nowhere.
class Outcomes {
 public:
  enum Where : std::uint32_t { back, collision, on, absorbed, kCount };

  void add(std::uint32_t where, const Particle& particle) {
    lists_[where][counts_[where]++] = particle;
  }
  std::uint32_t count(Where where) const { return counts_[where]; }
  std::span<const Particle> list(Where where) const {
    return std::span(lists_[where]).first(counts_[where]);
  }

 private:
  std::array<std::uint32_t, kCount> counts_{};
  std::array<std::array<Particle, kBlock>, kCount> lists_;
};

// The event-based version: the same physics, as a graph of two stages. An event is what happens to
// a particle in one place, and the flight to the next. The medium is the same for a whole batch,
// and no particle waits for another: that is what events have over histories.
inline Tally by_event(const Slab& slab, std::uint32_t count, std::uint32_t threads,
                      bool print_report) {
  std::vector<Tally> tallies(4096);
  carpool::Graph graph;
  const auto enter =
      graph.add_stage<Particle>({.name = "enter", .bins = slab.layers(), .block_items = kBlock});
  const auto collide = graph.add_stage<Particle>(
      {.name = "collide", .bins = slab.layers(), .block_items = kBlock, .rank = 1});
  const auto hand_on = [=, last = slab.layers() - 1](const Outcomes& outcomes, std::uint32_t layer,
                                                     Tally& tally, carpool::Emitter& out) {
    out.emit(collide, layer, outcomes.list(Outcomes::collision));
    if (layer > 0) {
      out.emit(enter, layer - 1, outcomes.list(Outcomes::back));
    } else {
      tally.reflected += outcomes.count(Outcomes::back);
    }
    if (layer < last) {
      out.emit(enter, layer + 1, outcomes.list(Outcomes::on));
    } else {
      tally.transmitted += outcomes.count(Outcomes::on);
    }
  };
  graph.set_kernel(enter, [&](const carpool::Batch<Particle>& batch, carpool::Emitter& out) {
    const Medium medium = slab.medium(batch.bin);
    Outcomes outcomes;
    for (Particle particle : batch.items) {
      const int step = medium.fly_without_branch(particle);
      outcomes.add(static_cast<std::uint32_t>(Outcomes::collision + step), particle);
    }
    hand_on(outcomes, batch.bin, tallies[batch.worker], out);
  });
  graph.set_kernel(collide, [&](const carpool::Batch<Particle>& batch, carpool::Emitter& out) {
    const Medium medium = slab.medium(batch.bin);
    Outcomes outcomes;
    for (Particle particle : batch.items) {
      const bool survives = medium.survives_without_branch(particle);
      const int step = medium.fly_without_branch(particle);
      const auto where = static_cast<std::uint32_t>(Outcomes::collision + step);
      const auto absorbed = Outcomes::absorbed * static_cast<std::uint32_t>(!survives);
      outcomes.add(where | absorbed, particle);  // `absorbed` has all bits; a ?: would be a branch
    }
    Tally& tally = tallies[batch.worker];
    tally.collisions += batch.items.size();
    tally.absorbed += outcomes.count(Outcomes::absorbed);
    hand_on(outcomes, batch.bin, tally, out);
  });
  std::atomic<std::uint32_t> next{0};
  const auto beam = graph.add_source(
      {.name = "beam", .concurrency = 0}, [&](carpool::SourceContext& ctx, carpool::Emitter& out) {
        const std::uint32_t first = next.fetch_add(ctx.budget);
        for (std::uint32_t id = first; id < std::min(count, first + ctx.budget); ++id) {
          out.emit(enter, 0, Slab::born(id));
        }
        return first + ctx.budget < count ? carpool::SourceStatus::more
                                          : carpool::SourceStatus::exhausted;
      });
  graph.add_edge(beam, enter);
  for (const auto to : {enter, collide}) {
    graph.add_edge(enter, to);
    graph.add_edge(collide, to);
  }
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
