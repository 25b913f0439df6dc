// The lists put together.
#include "tests/hard_cases/scenes.h"

#include <set>

namespace carpool::test {
namespace {

template <class T>
void Append(std::vector<T>& all, const std::vector<T>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

}  // namespace

const std::vector<ClosedForm>& ClosedForms() {
  static const std::vector<ClosedForm> all = [] {
    std::vector<ClosedForm> forms = LayerForms();
    Append(forms, FurnaceForms());
    Append(forms, LightForms());
    return forms;
  }();
  return all;
}

const std::vector<Twins>& AllTwins() {
  static const std::vector<Twins> all = [] {
    std::vector<Twins> twins = TransformTwins();
    Append(twins, StrategyTwins());
    Append(twins, ScaleTwins());
    return twins;
  }();
  return all;
}

bool& AtFullLength() {
  static bool full = false;
  return full;
}

std::vector<SceneCase> AllScenes() {
  std::vector<SceneCase> scenes;
  std::set<std::string> seen;
  const auto add = [&](const SceneCase& scene) {
    if (seen.insert(scene.name).second) scenes.push_back(scene);
  };
  for (const ClosedForm& form : ClosedForms()) add(form.scene);
  for (const Twins& twins : AllTwins()) {
    add(twins.a);
    add(twins.b);
  }
  return scenes;
}

}  // namespace carpool::test
