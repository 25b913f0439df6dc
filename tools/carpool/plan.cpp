// `carpool plan`: what would be simulated for a scene under this command line, and why.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <span>
#include <string>

#include "render/plan/plan.h"
#include "render/posix/atomic_file.h"
#include "tools/carpool/commands.h"
#include "tools/carpool/render_flags.h"

namespace carpool::tools {
namespace {

struct PlanFlags : RenderFlags {
  std::string dot_path;
  bool json = false;
};

render::ExitCode PlanAndPrint(const PlanFlags& flags) {
  const render::Plan plan = render::PlanScene(Settle(flags), Warn);
  if (!flags.dot_path.empty()) {
    render::WriteFileAtomically(flags.dot_path, std::as_bytes(std::span(plan.dot)));
  }
  const std::string text = flags.json ? plan.Json() : plan.Text();
  std::fputs(text.c_str(), stdout);
  if (!text.ends_with('\n')) std::fputc('\n', stdout);
  return render::ExitCode::done;
}

}  // namespace

Command PlanCommand(CLI::App& program) {
  const auto flags = std::make_shared<PlanFlags>();
  CLI::App* command = program.add_subcommand("plan", "what will be simulated, and why");
  AddSceneFlags(*command, *flags);
  command->add_option("--dot", flags->dot_path, "also write the stage graph for Graphviz")
      ->type_name("FILE");
  command->add_flag("--json", flags->json, "as one JSON object");
  return {command, [flags] { return PlanAndPrint(*flags); }};
}

}  // namespace carpool::tools
