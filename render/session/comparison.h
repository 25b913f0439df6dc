// What the reference executor found, in words and for scripts.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "render/session/session.h"

namespace carpool::render {

/// Lines: how many paths in float stayed with their selves in double, and the worst of them.
std::string ComparisonText(const RenderSummary& summary);
nlohmann::ordered_json ComparisonJson(const RenderSummary& summary);

}  // namespace carpool::render
