// What it costs that images are the same bytes in every order of samples: exact sums against
// floats.
#pragma once

#include <cstdint>

#include <tbb/task_arena.h>

namespace carpool::tools {

/// Nanoseconds of one thread per sample.
struct FilmPrice {
  double exact = 0;   // the film's 80-bit sums
  double floats = 0;  // a film of floats, locked alike, whose sums depend on the order
};

/// Adds samples to films of that size as renders do, on all threads of `arena`; medians.
FilmPrice MeasureFilmPrice(uint32_t width, uint32_t height, tbb::task_arena& arena);

}  // namespace carpool::tools
