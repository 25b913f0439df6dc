// The version that image headers and --version state.
#pragma once

#include <string_view>

namespace carpool::render {

inline constexpr std::string_view kVersion = CARPOOL_VERSION;

}  // namespace carpool::render
