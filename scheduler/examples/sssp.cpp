// sssp: shortest paths by delta-stepping. Bins are buckets of distance; a policy takes the nearest
// bucket first.
//
// Checked against Dijkstra's algorithm on a grid with random weights.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "sssp.h"

namespace {

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

int main(int argc, char** argv) {
  std::uint32_t side = 500;
  std::uint32_t threads = 0;
  std::uint32_t delta = 50;
  for (int i = 1; i < argc; i += 2) {
    std::uint32_t* const value = std::strcmp(argv[i], "--side") == 0      ? &side
                                 : std::strcmp(argv[i], "--threads") == 0 ? &threads
                                 : std::strcmp(argv[i], "--delta") == 0   ? &delta
                                                                          : nullptr;
    if (value == nullptr || i + 1 == argc) {
      std::fprintf(stderr, "usage: sssp [--side N] [--threads N] [--delta N]\n");
      return 2;
    }
    *value = static_cast<std::uint32_t>(std::strtoul(argv[i + 1], nullptr, 10));
  }
  delta = delta == 0 ? 1 : delta;
  const sssp::Grid grid(side == 0 ? 1 : side);
  auto begin = std::chrono::steady_clock::now();
  const std::vector<std::uint32_t> expected = sssp::dijkstra(grid);
  const double dijkstra_seconds = seconds_since(begin);
  begin = std::chrono::steady_clock::now();
  const std::vector<std::uint32_t> found = sssp::delta_stepping(grid, threads, delta);
  const double carpool_seconds = seconds_since(begin);
  begin = std::chrono::steady_clock::now();
  const bool equal =
      found == expected && sssp::delta_stepping_waves(grid, threads, delta) == expected;
  const double waves_seconds = seconds_since(begin);
  std::printf(
      "%u vertices: Dijkstra %.3f s, delta-stepping %.3f s, in waves %.3f s, distances %s\n",
      grid.vertices(), dijkstra_seconds, carpool_seconds, waves_seconds,
      equal ? "equal" : "DIFFERENT");
  return equal ? 0 : 1;
}
