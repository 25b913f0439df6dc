// transport: neutral particles through a layered slab, event by event. Events are stages, bins are
// layers.
//
// Checked against closed forms, and against a loop over histories with the same random numbers,
// which must find exactly the same tallies, because every random number is a pure function of
// (particle, event).
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <vector>

#include "carpool/carpool.h"

namespace {

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
};

// random is uniform in (0, 1): a hash of who asks, and of how often they have asked.
double random(Particle& particle) {
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
Tally by_history(const Slab& slab, std::uint32_t count) {
  Tally tally;
  for (std::uint32_t id = 0; id < count; ++id) {
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

// The event-based version: the same functions, as a graph of two stages.
Tally by_event(const Slab& slab, std::uint32_t count, std::uint32_t threads, bool print_report) {
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
    sum.reflected += tally.reflected;
    sum.transmitted += tally.transmitted;
    sum.absorbed += tally.absorbed;
    sum.collisions += tally.collisions;
  }
  return sum;
}

// Chandrasekhar's H function for isotropic scattering, by iteration of its integral equation.
double h_function(double cosine, double scattering) {
  constexpr int kPoints = 2000;
  std::vector<double> h(kPoints, 1.0);
  const auto at = [](int i) { return (i + 0.5) / kPoints; };
  const auto value = [&](double mu) {
    double integral = 0;
    for (int i = 0; i < kPoints; ++i) {
      integral += at(i) * h[static_cast<std::size_t>(i)] / (mu + at(i));
    }
    return 1 / (std::sqrt(1 - scattering) + scattering / 2 * integral / kPoints);
  };
  for (int round = 0; round < 30; ++round) {
    std::vector<double> next;
    for (int i = 0; i < kPoints; ++i) {
      next.push_back(value(at(i)));
    }
    h = next;
  }
  return value(cosine);
}

// check compares a frequency with a probability: within five standard deviations.
bool check(const char* what, std::uint64_t hits, std::uint32_t count, double expected) {
  const double found = static_cast<double>(hits) / count;
  const double sigma = std::sqrt(expected * (1 - expected) / count) + 1e-9;
  const bool good = std::abs(found - expected) < 5 * sigma;
  std::printf("%-44s %.6f, closed form %.6f, %+.1f sigma  %s\n", what, found, expected,
              (found - expected) / sigma, good ? "ok" : "WRONG");
  return good;
}

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

bool compare(const char* what, const Slab& slab, std::uint32_t count, std::uint32_t threads,
             bool report, Tally& tally) {
  auto begin = std::chrono::steady_clock::now();
  const Tally histories = by_history(slab, count);
  const double history_seconds = seconds_since(begin);
  begin = std::chrono::steady_clock::now();
  tally = by_event(slab, count, threads, report);
  const double event_seconds = seconds_since(begin);
  const bool same = tally == histories;
  std::printf("%-44s histories %.3f s, events %.3f s, tallies %s\n", what, history_seconds,
              event_seconds, same ? "identical" : "DIFFERENT");
  return same;
}

}  // namespace

int main(int argc, char** argv) {
  std::uint32_t count = 200'000;
  std::uint32_t threads = 0;
  bool report = false;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--histories") == 0 && i + 1 < argc) {
      count = static_cast<std::uint32_t>(std::strtoul(argv[++i], nullptr, 10));
    } else if (std::strcmp(argv[i], "--threads") == 0 && i + 1 < argc) {
      threads = static_cast<std::uint32_t>(std::strtoul(argv[++i], nullptr, 10));
    } else if (std::strcmp(argv[i], "--report") == 0) {
      report = true;
    } else {
      std::fprintf(stderr, "usage: transport [--histories N] [--threads N] [--report]\n");
      return 2;
    }
  }
  Tally tally;
  const double forever = std::numeric_limits<double>::infinity();

  const Slab absorber(
      {{.end = 0.5, .sigma = 1, .scattering = 0}, {.end = 1.0, .sigma = 3, .scattering = 0}});
  bool good = compare("two pure absorbers", absorber, count, threads, report, tally);
  good &= check("  transmitted, exp(-0.5 - 1.5)", tally.transmitted, count, std::exp(-2.0));

  const Slab half_space(
      {{.end = 1, .sigma = 1, .scattering = 0.9}, {.end = forever, .sigma = 2, .scattering = 0.9}});
  good &= compare("half-space that scatters 0.9", half_space, count, threads, report, tally);
  good &= check("  reflected, 1 - H(1) sqrt(1 - 0.9)", tally.reflected, count,
                1 - h_function(1, 0.9) * std::sqrt(0.1));
  return good ? 0 : 1;
}
