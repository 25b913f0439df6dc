// Shortest paths on a grid: the graph, Dijkstra's algorithm, and delta-stepping in two ways.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <queue>
#include <utility>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "carpool/carpool.h"

namespace sssp {

inline constexpr std::uint32_t kFar = ~0U;

// A square grid whose edges, to the four neighbours, have weights from 1 to 100.
class Grid {
 public:
  explicit Grid(std::uint32_t side) : side_(side) {}

  std::uint32_t vertices() const { return side_ * side_; }

  template <class Visit>
  void for_each_edge(std::uint32_t from, Visit visit) const {
    const std::uint32_t x = from % side_;
    const std::uint32_t y = from / side_;
    if (x > 0) visit(from - 1, weight(from - 1, 0));
    if (x + 1 < side_) visit(from + 1, weight(from, 0));
    if (y > 0) visit(from - side_, weight(from - side_, 1));
    if (y + 1 < side_) visit(from + side_, weight(from, 1));
  }

 private:
  static std::uint32_t weight(std::uint32_t vertex, std::uint32_t direction) {
    std::uint64_t x = (std::uint64_t{vertex} * 2 + direction + 1) * 0x9e3779b97f4a7c15ULL;
    x = (x ^ (x >> 32)) * 0xd6e8feb86659fd93ULL;
    return static_cast<std::uint32_t>(1 + (x >> 40) % 100);
  }
  std::uint32_t side_;
};

inline std::vector<std::uint32_t> dijkstra(const Grid& grid) {
  std::vector<std::uint32_t> distance(grid.vertices(), kFar);
  using Entry = std::pair<std::uint32_t, std::uint32_t>;  // distance, vertex
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  distance[0] = 0;
  queue.emplace(0, 0);
  while (!queue.empty()) {
    const auto [far, vertex] = queue.top();
    queue.pop();
    if (far == distance[vertex]) {
      grid.for_each_edge(vertex, [&, far = far](std::uint32_t to, std::uint32_t weight) {
        if (far + weight < distance[to]) {
          distance[to] = far + weight;
          queue.emplace(far + weight, to);
        }
      });
    }
  }
  return distance;
}

// lower sets a distance to a smaller value; false if it is no smaller.
inline bool lower(std::atomic<std::uint32_t>& distance, std::uint32_t value) {
  std::uint32_t seen = distance.load(std::memory_order_relaxed);
  while (value < seen) {
    if (distance.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
      return true;
    }
  }
  return false;
}

struct Visit {
  std::uint32_t vertex;
  std::uint32_t distance;
};

inline std::vector<std::uint32_t> delta_stepping(const Grid& grid, std::uint32_t threads,
                                                 std::uint32_t delta) {
  constexpr std::uint32_t kBuckets = 256;  // a ring: more than the buckets that are in use at once
  std::vector<std::atomic<std::uint32_t>> distance(grid.vertices());
  for (auto& value : distance) {
    value.store(kFar, std::memory_order_relaxed);
  }
  carpool::Graph graph;
  const auto relax = graph.add_stage<Visit>({.name = "relax", .bins = kBuckets});
  graph.set_kernel(relax, [&](const carpool::Batch<Visit>& batch, carpool::Emitter& out) {
    for (const Visit& visit : batch.items) {
      if (visit.distance != distance[visit.vertex].load(std::memory_order_relaxed)) {
        continue;  // a shorter way has been found meanwhile
      }
      grid.for_each_edge(visit.vertex, [&](std::uint32_t to, std::uint32_t weight) {
        const std::uint32_t far = visit.distance + weight;
        if (lower(distance[to], far)) {
          out.emit(relax, far / delta % kBuckets, Visit{to, far});
        }
      });
    }
  });
  const auto start =
      graph.add_source({.name = "start"}, [&](carpool::SourceContext&, carpool::Emitter& out) {
        lower(distance[0], 0);
        out.emit(relax, 0, Visit{0, 0});
        return carpool::SourceStatus::exhausted;
      });
  graph.add_edge(start, relax);
  graph.add_edge(relax, relax);

  // The nearest bucket first, full or not: whoever runs ahead finds ways that are no shortest ones,
  // and has to do it all again. One start becomes a whole front, whose size nobody knows
  // beforehand: let the memory grow with it.
  carpool::run(graph, {.threads = threads,
                       .policy = carpool::Policy::bins_in_ring(),
                       .overflow = carpool::Overflow::grow});
  return {distance.begin(), distance.end()};
}

// Delta-stepping as one would write it with oneTBB alone: a parallel_for per bucket, again while
// relaxing puts more into it.
inline std::vector<std::uint32_t> delta_stepping_waves(const Grid& grid, std::uint32_t threads,
                                                       std::uint32_t delta) {
  constexpr std::uint32_t kBuckets = 256;
  using Buckets = std::vector<std::vector<Visit>>;
  std::vector<std::atomic<std::uint32_t>> distance(grid.vertices());
  for (auto& value : distance) {
    value.store(kFar, std::memory_order_relaxed);
  }
  Buckets buckets(kBuckets);
  tbb::enumerable_thread_specific<Buckets> found([] { return Buckets(kBuckets); });
  tbb::task_arena arena(threads == 0 ? tbb::task_arena::automatic : static_cast<int>(threads));
  distance[0].store(0, std::memory_order_relaxed);
  buckets[0].push_back({0, 0});
  std::uint32_t empty = 0;  // buckets in a row; after all of them nothing is left
  for (std::uint32_t bucket = 0; empty < kBuckets; bucket = (bucket + 1) % kBuckets) {
    ++empty;
    while (!buckets[bucket].empty()) {
      empty = 0;
      const std::vector<Visit> now = std::exchange(buckets[bucket], {});
      arena.execute([&] {
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, now.size(), 256), [&](const auto& range) {
              Buckets& mine = found.local();
              for (std::size_t i = range.begin(); i != range.end(); ++i) {
                const Visit visit = now[i];
                if (visit.distance != distance[visit.vertex].load(std::memory_order_relaxed)) {
                  continue;
                }
                grid.for_each_edge(visit.vertex, [&](std::uint32_t to, std::uint32_t weight) {
                  const std::uint32_t far = visit.distance + weight;
                  if (lower(distance[to], far)) {
                    mine[far / delta % kBuckets].push_back({to, far});
                  }
                });
              }
            });
      });
      for (Buckets& part : found) {
        for (std::uint32_t to = 0; to < kBuckets; ++to) {
          buckets[to].insert(buckets[to].end(), part[to].begin(), part[to].end());
          part[to].clear();
        }
      }
    }
  }
  return {distance.begin(), distance.end()};
}

}  // namespace sssp
