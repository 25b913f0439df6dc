// What a render says about itself, for people and for scripts.
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

#include "render/session/comparison.h"
#include "render/session/ledger.h"
#include "render/session/session.h"
#include "render/session/version.h"

namespace carpool::render {
namespace {

__attribute__((format(printf, 1, 2))) std::string Format(const char* format, ...) {
  char line[512];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(line, sizeof line, format, arguments);
  va_end(arguments);
  return line;
}

double Mebibytes(uint64_t bytes) {
  return static_cast<double>(bytes) / (1 << 20);
}

/// Scheduler time over the worker time of the last pass.
double SchedulerShare(const RunReport& r) {
  const double busy = r.kernel_seconds + r.source_seconds + r.scheduler_seconds + r.idle_seconds;
  return busy > 0 ? r.scheduler_seconds / busy : 0;
}

/// The camera as it was placed, for programs that are to see the same.
nlohmann::ordered_json ViewJson(const RenderSummary& s) {
  const float* m = s.view.world_from_camera;
  const auto axis = [&](int column) {
    return nlohmann::json{m[column], m[4 + column], m[8 + column]};
  };
  return {{"projection", s.view.orthographic != 0 ? "orthographic" : "perspective"},
          {"position", s.eye},
          {"right", axis(0)},
          {"up", axis(1)},
          {"back", axis(2)},
          {"half_width", s.view.half_width},
          {"half_height", s.view.half_height}};
}

}  // namespace

std::string RenderSummary::Text() const {
  std::ostringstream out;
  out << Format("%s: %dx%d, %d samples per pixel", output.c_str(), width, height, samples);
  if (noise >= 0) out << Format(", noise %.2f %%", 100 * noise);
  out << "\n";
  const double seconds = render_seconds > 0 ? render_seconds : 1e-9;
  out << Format("  %.2f s load, %.2f s BVH, %.2f s render, %.2f s save\n", load_seconds,
                bvh_seconds, render_seconds, save_seconds);
  out << Format("  %s on %s (%s): %.2f M rays/s, %.3f M samples/s\n", executor.c_str(), isa.c_str(),
                executor_reason.c_str(), static_cast<double>(rays.total()) / seconds / 1e6,
                static_cast<double>(rays.camera) / seconds / 1e6);
  out << Format("  memory: %.1f MiB BVH, %.1f MiB film, %.1f MiB path state and queues\n",
                Mebibytes(bvh_bytes), Mebibytes(film_bytes), Mebibytes(state_bytes + queue_bytes));
  if (!schedule.stages.empty())
    out << Format("  scheduler: %.2f %% of worker time\n", 100 * SchedulerShare(schedule));
  if (comparison.paths > 0) out << ComparisonText(*this);
  if (ledger.Count() > 0) out << "  samples: " << LedgerText(*this) << "\n";
  return out.str();
}

std::string RenderSummary::Json() const {
  nlohmann::ordered_json json = {
      {"version", kVersion},
      {"scene", scene},
      {"output", output},
      {"camera", camera},
      {"view", ViewJson(*this)},
      {"environment", environment},
      {"executor", executor},
      {"executor_reason", executor_reason},
      {"isa", isa},
      {"width", width},
      {"height", height},
      {"samples", samples},
      {"seed", seed},
      {"noise", noise},
      {"sample_ledger", LedgerJson(*this)},
      {"rays", {{"camera", rays.camera}, {"bounce", rays.bounce}, {"shadow", rays.shadow}}},
      {"seconds",
       {{"load", load_seconds},
        {"bvh", bvh_seconds},
        {"render", render_seconds},
        {"save", save_seconds},
        {"first_preview", first_preview_seconds}}},
      {"bytes",
       {{"bvh", bvh_bytes},
        {"film", film_bytes},
        {"path_state", state_bytes},
        {"queues", queue_bytes}}}};
  if (comparison.paths > 0) json["comparison"] = ComparisonJson(*this);
  if (!schedule.stages.empty())
    json["last_pass"] = nlohmann::ordered_json::parse(schedule.to_json());
  return json.dump(2) + "\n";
}

}  // namespace carpool::render
