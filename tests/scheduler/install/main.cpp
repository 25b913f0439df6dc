// A program of somebody else's that uses the installed library.
#include <array>
#include <cstdint>
#include <cstdio>

#include "carpool/carpool.h"

int main() {
  carpool::Graph graph;
  const auto square = graph.add_stage<int>({.name = "square", .bins = 10});
  std::array<long, 2> sums{};
  graph.set_kernel(square, [&](const carpool::Batch<int>& batch, carpool::Emitter&) {
    for (const int item : batch.items) {
      sums[batch.worker] += long{item} * item;
    }
  });
  graph.add_source({.name = "one to thousand"},
                   [&](carpool::SourceContext&, carpool::Emitter& out) {
                     for (int i = 1; i <= 1000; ++i) {
                       out.emit(square, static_cast<std::uint32_t>(i % 10), i);
                     }
                     return carpool::SourceStatus::exhausted;
                   });
  carpool::run(graph, {.threads = 2});
  std::printf("%s %ld\n", CARPOOL_VERSION, sums[0] + sums[1]);
}
