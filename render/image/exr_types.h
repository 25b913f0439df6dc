// The header attributes that EXR files of ours carry.
#pragma once

#include <map>
#include <string>
#include <variant>

namespace carpool::render {

/// By name, for example {"carpool:seed", 7}. Names of the format's own attributes are not allowed,
/// except free ones such as "whiteLuminance" or "comments".
using ExrAttributes = std::map<std::string, std::variant<std::string, float, int>>;

}  // namespace carpool::render
