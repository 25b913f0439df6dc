// All scenes of the suite, as data: what `hard-cases --write` writes, the tests render and the soak
// varies.
#pragma once

#include <ostream>
#include <vector>

#include "tests/hard_cases/checks.h"

namespace carpool::test {

/// A scene whose image has a known mean.
struct ClosedForm {
  int row;  // of the list of hard cases
  SceneCase scene;
  Claim claim;
};
/// What GoogleTest prints of a parameter.
inline void PrintTo(const ClosedForm& form, std::ostream* out) {
  *out << form.scene.name;
}
/// Every closed form; the order is that of the rows.
const std::vector<ClosedForm>& ClosedForms();

/// Two scenes whose images have one mean; the second's is multiplied by `scale`.
struct Twins {
  int row;
  SceneCase a, b;
  Claim claim;
  double scale = 1;
};
inline void PrintTo(const Twins& twins, std::ostream* out) {
  *out << twins.a.name << " = " << twins.b.name;
}
const std::vector<Twins>& AllTwins();

/// `hard-cases --full`: counts as the list of hard cases has them, where the suite makes do with
/// fewer.
bool& AtFullLength();

/// Both lists' scenes, each once.
std::vector<SceneCase> AllScenes();

// Parts of the lists, by what they are about.
std::vector<ClosedForm> FurnaceForms();
std::vector<ClosedForm> LightForms();
std::vector<ClosedForm> LayerForms();
std::vector<Twins> StrategyTwins();
std::vector<Twins> TransformTwins();
std::vector<Twins> ScaleTwins();

/// Row 46: a room with an object in it whose light and shade depend on all of its geometry, scaled
/// and then moved, camera included.
SceneCase RoomAt(double scale, const Point& offset);

/// A white surface of glTF's model.
int AddWhite(SceneBuilder& b, double metallic, double roughness);

}  // namespace carpool::test
