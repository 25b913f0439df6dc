// The sampling and numeric kernels as plain functions over columns of numbers, for every target and
// width.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "stages/sampling/dimensions.h"

namespace carpool::tests {

/// One vector per quantity; all of one length, which is a multiple of 64.
using Columns = std::vector<std::vector<double>>;
using Words = std::vector<uint32_t>;

/// What names random numbers: equally long columns.
struct Draws {
  Words pixel, sample, vertex, iteration;
  uint32_t seed = 0;
  stages::Purpose purpose = stages::Purpose::bsdf;
};

/// One target at one width. Results are exact copies of the lanes, as double.
struct SamplingKernels {
  std::string name;  // "AVX2 x8", "AVX2 x1", "AVX2 double x4"
  bool is_double;
  std::vector<double> (*unit)(const Words&);  // words to [0, 1)
  std::vector<double> (*sample1)(const Draws&);
  Columns (*sample2)(const Draws&);
  std::vector<double> (*hash)(const Draws&);
  /// Functions of the columns given: (u, v) -> offset; (u, v) -> direction; (turns) -> cos, sin;
  /// (x) -> 2^x - 1; normal -> t, b; x -> sqrt; (a, b) -> a / b; vector -> unit vector or (0, 0,
  /// 1).
  Columns (*filter)(const Columns&);
  Columns (*cosine)(const Columns&);
  Columns (*cos_sin)(const Columns&);
  Columns (*exp2_minus1)(const Columns&);
  Columns (*frame)(const Columns&);
  Columns (*safe_sqrt)(const Columns&);
  Columns (*safe_div)(const Columns&);
  Columns (*safe_normalize)(const Columns&);
};

/// Every target this machine has: at full width, at one lane, and in double.
const std::vector<SamplingKernels>& AllSamplingKernels();

/// The full width of the best target.
const SamplingKernels& BestSamplingKernels();

}  // namespace carpool::tests
