// What the snippets of the scheduler's README take for granted: their types and functions.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <tbb/info.h>
#include <tbb/task_arena.h>

#include "carpool/carpool.h"

using namespace std::chrono_literals;

struct Ray {
  float direction[3];
};
struct Hit {
  std::uint32_t material;
};
struct Leaf {
  std::uint32_t index;
};
struct Row {
  std::uint32_t index;
};
struct Name {
  std::uint32_t index;
};
struct Sum {
  void add(const Hit& hit);
};

std::optional<Hit> intersect(const Ray& ray);
std::optional<Ray> bounce(const Hit& hit);
Ray camera_ray(std::uint32_t index);
carpool::SourceStatus read_queries(carpool::SourceContext& ctx, carpool::Emitter& out);
double measured_costs(std::uint32_t stage, std::uint32_t items);
carpool::Emitter& emitter_of_the_call();
