// transport: neutral particles through a layered slab, event by event. Events are stages, bins are
// layers.
//
// Checked against closed forms, and against a loop over histories with the same random numbers,
// which must find exactly the same tallies, because every random number is a pure function of
// (particle, event).
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <vector>

#include "transport.h"

namespace {

using transport::Slab;
using transport::Tally;

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
  const Tally histories = transport::by_history(slab, 0, count);
  const double history_seconds = seconds_since(begin);
  begin = std::chrono::steady_clock::now();
  tally = transport::by_event(slab, count, threads, report);
  const double event_seconds = seconds_since(begin);
  begin = std::chrono::steady_clock::now();
  const Tally parallel = transport::by_history_parallel(slab, count, threads);
  const double parallel_seconds = seconds_since(begin);
  const bool same = tally == histories && parallel == histories;
  std::printf("%-44s histories %.3f s, parallel_reduce %.3f s, events %.3f s, tallies %s\n", what,
              history_seconds, parallel_seconds, event_seconds, same ? "identical" : "DIFFERENT");
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
