// The ledger of samples in words and as JSON: what was not taken as it came, and where first.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "render/session/session.h"

namespace carpool::render {

/// One line, e.g. "3 not finite (first: pixel 5,7, sample 2), 0 negative, ...".
std::string LedgerText(const RenderSummary& summary);

nlohmann::ordered_json LedgerJson(const RenderSummary& summary);

}  // namespace carpool::render
