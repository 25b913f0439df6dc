// Deliberate mistakes, to prove that the tests can fail.
//
// They exist only in a build with CARPOOL_MUTANTS (preset `mutants`), where the environment
// variable CARPOOL_MUTANT names the one that is made; elsewhere they cost nothing. `tools/test
// --mutants` runs the hard cases against each.
#pragma once

#ifdef CARPOOL_MUTANTS
#include <array>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <utility>
#endif

namespace carpool::stages {

enum class Mutant {
  none,
  large_pdf,       // BSDF sampling states a density 0.5 % too large
  missing_cosine,  // the diffuse lobe forgets cos(theta)
  swapped_mis,     // each strategy takes the other's weight
  shifted_texel,   // texel centres at whole numbers
  float_film,      // sums in single precision
  epsilon_offset,  // ray origins moved by a fixed distance
  naive_uniform,   // all 31 bits of a random word, which round up to 1
  naive_ggx,       // D(h) from 1 - cos^2
  shifted_sky,     // the environment's texel centres at whole numbers, for looking up alone
  rejected_nan,    // samples that are not finite vanish without a word
  blurred_lights,  // triangles are sampled from however near their planes
};

#ifdef CARPOOL_MUTANTS

inline Mutant MutantFromEnvironment() {
  constexpr std::array<std::pair<std::string_view, Mutant>, 12> kNames{
      {{"none", Mutant::none},
       {"large_pdf", Mutant::large_pdf},
       {"missing_cosine", Mutant::missing_cosine},
       {"swapped_mis", Mutant::swapped_mis},
       {"shifted_texel", Mutant::shifted_texel},
       {"float_film", Mutant::float_film},
       {"epsilon_offset", Mutant::epsilon_offset},
       {"naive_uniform", Mutant::naive_uniform},
       {"naive_ggx", Mutant::naive_ggx},
       {"shifted_sky", Mutant::shifted_sky},
       {"rejected_nan", Mutant::rejected_nan},
       {"blurred_lights", Mutant::blurred_lights}}};
  const char* const wanted = std::getenv("CARPOOL_MUTANT");
  if (wanted == nullptr) return Mutant::none;
  for (const auto& [name, mutant] : kNames) {
    if (name == wanted) return mutant;
  }
  std::fprintf(stderr, "CARPOOL_MUTANT=%s: no such mutant; stages/mutants.h lists them\n", wanted);
  std::abort();
}

inline bool IsMutant(Mutant mutant) {
  static const Mutant active = MutantFromEnvironment();
  return mutant == active;
}

#else

constexpr bool IsMutant(Mutant) {
  return false;
}

#endif

}  // namespace carpool::stages
