// What the light tree knows of a set of lights: where they are, which way they shine, how strongly.
#pragma once

#include <array>
#include <cstdint>

namespace carpool::render {

using Point3 = std::array<double, 3>;

/// A set of lights as Conty Estevez & Kulla 2018 bound it. Angles are in radians.
struct LightCluster {
  Point3 lo = {0, 0, 0}, hi = {0, 0, 0};
  Point3 axis = {0, 0, 1};
  double theta_o = 0;  // emitters' normals are within this angle of the axis
  double theta_e = 0;  // each emits within this angle of its normal
  double power = 0;    // candela of luminance at most, summed; 0: an empty set
  bool two_sided = false;
  double radius = 0;   // of a sphere about the box's centre that holds everything
  int32_t light = -1;  // of a single light
};

Point3 Center(const LightCluster& cluster);

/// The least cluster of this form, or nearly so, that holds both; either may be empty.
LightCluster Union(const LightCluster& a, const LightCluster& b);

/// The surface area orientation heuristic's measure: power x solid angle of the directions that are
/// shone into x surface area.
double Cost(const LightCluster& cluster);

}  // namespace carpool::render
