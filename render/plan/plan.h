// Reads what a scene and its settings really use, and decides which stages, lobes, queues and
// channels exist.
#pragma once

#include <string>
#include <vector>

#include "render/scene/assemble.h"
#include "render/session/settings.h"
#include "stages/film/accumulator.h"

namespace carpool::render {

/// One part of the renderer: is it in this render, and why.
struct PlanPart {
  std::string kind;  // "stage", "effect", "light", "film", "BVH"
  std::string name;
  bool present = false;
  std::string why;
};

struct Plan {
  std::string scene;
  std::vector<PlanPart> parts;
  stages::FilmPlanes film;
  bool standard_error = false, sample_count = false;
  Executor executor = Executor::wavefront;
  std::string executor_reason;
  std::string dot;  // the stage graph in Graphviz's language

  /// Does the first hit of a path have to be recorded for an AOV?
  bool first_hits() const {
    return film.albedo || film.normal || film.depth || film.object || film.material;
  }
  std::string Text() const;
  std::string Json() const;
};

/// MakePlan decides for a scene that is loaded. `dot` is filled by PlanScene alone.
Plan MakePlan(const PreparedScene& scene, const RenderSettings& settings);

/// PlanScene loads the scene and plans it, without building a BVH: `carpool plan`.
Plan PlanScene(const RenderSettings& settings, const WarningSink& warn);

}  // namespace carpool::render
