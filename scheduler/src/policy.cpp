// The policies that come with the scheduler.
#include "carpool/policy.h"

#include <stdexcept>
#include <utility>

namespace carpool {
namespace {
constexpr std::uint32_t kMostLanes = 65536;
constexpr std::uint32_t kFillLanes = 8;  // fullest-first tells apart eighths of a block
}  // namespace

Policy::Policy(Kind kind, std::string name, std::uint32_t lanes, LaneFunction lane_of)
    : kind_(kind), name_(std::move(name)), lanes_(lanes), lane_of_(std::move(lane_of)) {}

Policy Policy::deepest_first() {
  return {Kind::deepest_first, "deepest-first", 1, {}};
}

Policy Policy::fullest_first() {
  return {Kind::fullest_first, "fullest-first", kFillLanes, {}};
}

Policy Policy::oldest_first() {
  return {Kind::oldest_first, "oldest-first", 1, {}};
}

Policy Policy::bins_in_order() {
  return {Kind::bins_in_order, "bins in order", 0, {}};
}

Policy Policy::bins_in_ring() {
  Policy policy{Kind::bins_in_order, "bins in a ring", 0, {}};
  policy.ring_ = true;
  return policy;
}

Policy Policy::custom(std::string name, std::uint32_t lanes, LaneFunction lane_of) {
  if (lanes == 0 || lanes > kMostLanes || !lane_of) {
    throw std::invalid_argument("carpool: policy '" + name +
                                "' needs a lane function and 1 to 65,536 lanes");
  }
  return {Kind::custom, std::move(name), lanes, std::move(lane_of)};
}

}  // namespace carpool
