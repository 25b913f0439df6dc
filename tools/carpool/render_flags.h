// The flags that say what to render, shared by the commands that render and that plan.
#pragma once

#include <optional>
#include <string>

#include "render/session/explain.h"
#include "render/session/settings.h"

namespace CLI {
class App;
}

namespace carpool::tools {

/// What the command line said, before names and sizes are understood. CLI11 writes into it while
/// parsing, so it must live as long as the command.
struct RenderFlags {
  render::RenderSettings settings;
  std::string size, aovs, executor = "auto", policy = "deepest", isa = "auto", direct = "mis",
                          lights = "tree";
  std::optional<int> samples;
  bool no_png = false, no_robust = false;
  std::string pixel;  // "X,Y"
  uint32_t sample = 0;
  bool explain = false;
  bool needs_output = false;  // the command writes an image
};

/// AddSceneFlags adds what decides which work a render has: scene, view, image, length, executor.
void AddSceneFlags(CLI::App& command, RenderFlags& flags);

/// AddMachineFlags adds how the machine is used: threads, memory, batches, policy, instruction set.
void AddMachineFlags(CLI::App& command, RenderFlags& flags);

/// AddRunFlags adds these, and where results go.
void AddRunFlags(CLI::App& command, RenderFlags& flags);

/// The sample that --pixel and --sample name; throws Error(ExitCode::usage) if --pixel is no pixel.
render::SampleName NamedSample(const RenderFlags& flags);

/// Settle returns the settings the flags ask for; throws Error(ExitCode::usage) for what makes no
/// sense.
render::RenderSettings Settle(const RenderFlags& flags);

}  // namespace carpool::tools
