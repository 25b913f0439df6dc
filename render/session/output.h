// What a finished or interrupted render leaves behind: EXR, PNG, statistics.
#pragma once

#include <string>

#include "render/plan/plan.h"
#include "render/session/session.h"
#include "stages/film/accumulator.h"

namespace carpool::render {

/// Beauty and the layers of the plan, with metadata. Atomic.
void WriteImage(const std::string& path, const stages::FilmAccumulator& film, const Plan& plan,
                const RenderSummary& summary);

/// Tone-mapped beauty. With `preview`, pixels without a sample borrow a neighbour's.
void WritePicture(const std::string& path, const stages::FilmAccumulator& film, float exposure_ev,
                  bool preview);

/// A text file, atomically.
void WriteText(const std::string& path, const std::string& text);

}  // namespace carpool::render
