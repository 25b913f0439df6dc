// The plan: one small function per kind of part, each with its reason.
#include "render/plan/plan.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <sstream>

#include "render/session/workspace.h"

namespace carpool::render {
namespace {

using stages::AlphaMode;
using stages::Material;
using stages::SceneTables;

std::string Count(size_t n, const char* one, const std::string& many) {
  return std::to_string(n) + " " + (n == 1 ? std::string(one) : many);
}

/// The materials that placements really use.
std::vector<Material> UsedMaterials(const SceneTables& tables) {
  std::vector<bool> used(tables.materials.size());
  for (const stages::Placement& p : tables.geometry.placements) used[p.material] = true;
  std::vector<Material> materials;
  for (size_t i = 0; i < used.size(); ++i) {
    if (used[i]) materials.push_back(tables.materials[i]);
  }
  return materials;
}

template <class Predicate>
size_t CountIf(const std::vector<Material>& materials, Predicate predicate) {
  return static_cast<size_t>(std::count_if(materials.begin(), materials.end(), predicate));
}

bool IsUnlit(const Material& m) {
  return (m.flags & stages::kMaterialUnlit) != 0;
}

void AddEffect(Plan& plan, const char* name, size_t materials, const char* what) {
  plan.parts.push_back({"effect", name, materials > 0,
                        materials > 0 ? Count(materials, "material", "materials") + " " + what
                                      : std::string("no material ") + what});
}

void PlanEffects(Plan& plan, const std::vector<Material>& used) {
  const auto uses = [&](stages::Slot slot) {
    return CountIf(
        used, [&](const Material& m) { return m.slots[static_cast<int>(slot)] != stages::kNone; });
  };
  AddEffect(plan, "base colour textures", uses(stages::Slot::base_color), "with one");
  AddEffect(plan, "metal-roughness textures", uses(stages::Slot::metallic_roughness), "with one");
  AddEffect(plan, "normal mapping", uses(stages::Slot::normal), "with a normal map");
  AddEffect(plan, "emission textures", uses(stages::Slot::emissive), "with one");
  AddEffect(plan, "specular textures",
            uses(stages::Slot::specular) + uses(stages::Slot::specular_color),
            "with one (KHR_materials_specular)");
  AddEffect(plan, "transparency by alpha",
            CountIf(used, [](const Material& m) { return m.alpha_mode != AlphaMode::opaque; }),
            "whose alpha is anywhere below its threshold");
  AddEffect(plan, "unlit surfaces", CountIf(used, IsUnlit), "with KHR_materials_unlit");
}

template <class OfKind>
size_t CountLights(const SceneTables& tables, const OfKind& of_kind) {
  const auto& lights = tables.lights.lights;
  return static_cast<size_t>(
      std::count_if(lights.begin(), lights.end(),
                    [&](const stages::Light& light) { return of_kind(light.type); }));
}

void PlanLights(Plan& plan, const PreparedScene& scene) {
  const stages::LightTables& lights = scene.tables.lights;
  const size_t triangles = CountLights(scene.tables, stages::IsTriangle);
  const size_t punctual = CountLights(scene.tables, [](stages::LightType type) {
    return type == stages::LightType::point || type == stages::LightType::spot;
  });
  const auto add = [&](const char* name, bool present, std::string why) {
    plan.parts.push_back({"light", name, present, std::move(why)});
  };
  add("light tree", lights.tree_probability > 0,
      triangles + punctual == 0
          ? "no emissive triangle, no point or spot light"
          : Count(triangles, "emissive triangle", "emissive triangles") + ", " +
                Count(punctual, "point or spot light", "point or spot lights"));
  add("directional lights", !lights.infinite_lights.empty(),
      lights.infinite_lights.empty() ? "none in the scene"
                                     : Count(lights.infinite_lights.size(), "light", "lights"));
  add("environment", lights.environment.width > 0,
      scene.environment_name.empty() ? "the scene has lights of its own and --env is not given"
                                     : scene.environment_name);
}

void PlanStages(Plan& plan, const PreparedScene& scene, const std::vector<Material>& used,
                const RenderSettings& settings) {
  const stages::LightTables& lights = scene.tables.lights;
  const bool any_light = stages::HasLights(stages::LightViewOf(scene.tables));
  const auto add = [&](const char* name, bool present, std::string why) {
    plan.parts.push_back({"stage", name, present, std::move(why)});
  };
  add("camera", true, "makes and traces coherent packets of 4x2 pixels");
  add("intersect", true, "rays that bounced, or passed a transparent layer");
  add("shade", true, Count(used.size(), "material", "materials") + " in use");
  add("shadow", any_light && settings.max_depth > 0,
      !any_light                ? "no light to sample"
      : settings.max_depth == 0 ? "--depth 0 shows emission alone"
                                : "one shadow ray per vertex");
  add("environment", lights.environment.width > 0,
      lights.environment.width > 0 ? "rays that leave the scene"
                                   : "rays that leave the scene are black");
  add("film", true, "exact sums, 128 bytes per pixel");
}

void PlanFilm(Plan& plan, const RenderSettings& settings) {
  const auto add = [&](const char* name, Aov aov) {
    const bool present = settings.aovs.Has(aov);
    plan.parts.push_back({"film", name, present, present ? "asked for by --aov" : "not asked for"});
    return present;
  };
  plan.film.albedo = add("albedo", Aov::albedo);
  plan.film.normal = add("normal", Aov::normal);
  plan.film.depth = add("depth", Aov::depth);
  plan.film.object = add("object", Aov::object);
  plan.film.material = add("material", Aov::material);
  plan.standard_error = add("stderr", Aov::standard_error);
  plan.sample_count = add("count", Aov::count);
}

void PlanBvh(Plan& plan, const PreparedScene& scene, const std::vector<Material>& used,
             const RenderSettings& settings) {
  const auto add = [&](const char* name, bool present, std::string why) {
    plan.parts.push_back({"BVH", name, present, std::move(why)});
  };
  const bool transparent =
      CountIf(used, [](const Material& m) { return m.alpha_mode != AlphaMode::opaque; }) > 0;
  add("flat triangles", scene.placement.flat_triangles > 0,
      Count(scene.placement.flat_triangles, "triangle", "triangles"));
  add("instances", !scene.placement.instanced.empty(),
      scene.placement.instanced.empty()
          ? "every mesh is used once, or small enough to copy"
          : Count(scene.placement.instanced.size(), "instance", "instances") + ", " +
                Count(scene.placement.instanced_triangles, "triangle", "triangles") + " as drawn");
  add("transparent level", transparent,
      transparent ? "shadow rays must ask some materials for their alpha" : "all is opaque");
  add("ROBUST", settings.robust,
      settings.robust ? "no ray slips between triangles" : "--no-robust");
}

void PlanExecutor(Plan& plan, const RenderSettings& settings) {
  if (settings.executor != Executor::automatic) {
    plan.executor = settings.executor;
    plan.executor_reason = "asked for";
    return;
  }
  const bool traced = !settings.trace_path.empty();
  plan.executor = traced ? Executor::wavefront : Executor::automatic;
  plan.executor_reason = traced
                             ? "--trace shows its stages"
                             : "wavefront or megakernel, whichever the first samples show faster";
}

}  // namespace

Plan MakePlan(const PreparedScene& scene, const RenderSettings& settings) {
  Plan plan;
  plan.scene = settings.scene_path;
  const std::vector<Material> used = UsedMaterials(scene.tables);
  PlanStages(plan, scene, used, settings);
  PlanEffects(plan, used);
  PlanLights(plan, scene);
  PlanFilm(plan, settings);
  PlanBvh(plan, scene, used, settings);
  PlanExecutor(plan, settings);
  return plan;
}

Plan PlanScene(const RenderSettings& settings, const WarningSink& warn) {
  Threads threads(settings.threads);
  return threads.arena().execute([&] {
    const PreparedScene scene = LoadScene(settings, warn);
    Plan plan = MakePlan(scene, settings);
    const stages::KernelContext context = MakeContext(scene, plan, settings);
    stages::ExecutorOptions options;
    options.arena = &threads.arena();
    options.threads = static_cast<uint32_t>(threads.count());
    plan.dot = stages::MakeWavefront(context, KernelsFor(settings.isa),
                                     scene.tables.geometry.placements, options)
                   ->Dot();
    return plan;
  });
}

std::string Plan::Text() const {
  std::ostringstream out;
  out << scene << ": what will be simulated, and why\n";
  std::string kind;
  for (const PlanPart& part : parts) {
    if (part.kind != kind) out << "\n" << (kind = part.kind) << "\n";
    out << "  " << (part.present ? "+ " : "- ") << part.name;
    out << std::string(part.name.size() < 26 ? 26 - part.name.size() : 1, ' ') << part.why << "\n";
  }
  out << "\nexecutor\n  " << Name(executor) << " (" << executor_reason << ")\n";
  return out.str();
}

std::string Plan::Json() const {
  nlohmann::ordered_json json;
  json["scene"] = scene;
  json["executor"] = Name(executor);
  json["parts"] = nlohmann::ordered_json::array();
  for (const PlanPart& part : parts) {
    json["parts"].push_back(
        {{"kind", part.kind}, {"name", part.name}, {"present", part.present}, {"why", part.why}});
  }
  return json.dump(2) + "\n";
}

}  // namespace carpool::render
