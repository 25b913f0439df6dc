// Runs the experiments place by place.
#include "tests/hard_cases/table.h"

#include <chrono>
#include <cstdio>

#include "tests/hard_cases/rays.h"
#include "tests/hard_cases/scenes.h"

namespace carpool::test {
namespace {

constexpr uint64_t kRays = 400'000;

struct Place {
  double scale, offset;
};
// Offsets move geometry away from the camera, which everything is relative to. What is smaller than
// 64 steps of the float grid there is no shape any more and is left out.
constexpr Place kPlaces[] = {{1e-6, 0}, {1e-3, 0}, {1, 0},   {1e3, 0}, {1e6, 0},
                             {1, 1},    {1, 1e2},  {1, 1e4}, {1, 1e5}, {1e3, 1e6}};

double SecondsOf(const auto& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

SceneCase Robust(SceneCase scene, bool robust) {
  scene.settings.robust = robust;
  return scene;
}

void PrintRow(const Place& place, bool robust) {
  const LoadedCase sphere(Robust(FarSphere(place.scale, place.offset), robust));
  const LoadedCase soup(Robust(Soup(place.scale, place.offset, false), robust));
  uint64_t leaks = 0;
  const double seconds =
      SecondsOf([&] { leaks = CountLeaks(sphere, place.scale, place.offset, kRays); });
  const Scattered scattered = ScatterAll(soup, place.scale, kRays);
  const double room =
      CaseRenderer(Robust(RoomAt(place.scale, {0, 0, 0}), robust)).Seeds(1, 8).Value();
  const double same = CaseRenderer(Robust(RoomAt(1, {0, 0, 0}), true)).Seeds(1, 8).Value();
  std::printf("%8g %8g  %-6s %10.2g %10.2g %12.2g %10.3f\n", place.scale, place.offset,
              robust ? "on" : "off", RateInterval(leaks, kRays, 0.98).high,
              RateInterval(scattered.self_hits, std::max<uint64_t>(1, scattered.rays), 0.98).high,
              room / same - 1, seconds);
}

}  // namespace

void PrintTable() {
  std::printf("%8s %8s  %-6s %10s %10s %12s %10s\n", "scale", "offset", "robust", "leaks <",
              "self-hits <", "room's error", "seconds");
  for (const Place& place : kPlaces) {
    for (const bool robust : {true, false}) PrintRow(place, robust);
  }
  std::printf(
      "leaks and self-hits: upper bounds with 99 %% confidence, of %llu rays each; the room "
      "has the row's scale,\nwith the same random numbers; seconds: for the leak rays\n",
      static_cast<unsigned long long>(kRays));
}

}  // namespace carpool::test
