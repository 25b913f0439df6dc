// `carpool info`: what a file contains, with warnings.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "render/gltf/gltf.h"
#include "tools/carpool/commands.h"

namespace carpool::tools {
namespace {

struct InfoFlags {
  std::string scene_path;
  render::LoadOptions load;
  bool json = false;
};

render::ExitCode Info(const InfoFlags& flags) {
  render::LoadOptions options = flags.load;
  options.warn = Warn;
  const render::ImportedScene scene = render::LoadGltf(flags.scene_path, options);
  const std::string text = flags.json ? DescribeSceneJson(scene) : DescribeScene(scene);
  std::fputs(text.c_str(), stdout);
  if (!text.ends_with('\n')) std::fputc('\n', stdout);
  return render::ExitCode::done;
}

}  // namespace

Command InfoCommand(CLI::App& program) {
  const auto flags = std::make_shared<InfoFlags>();
  CLI::App* command = program.add_subcommand("info", "what a scene file contains, with warnings");
  command->add_option("SCENE", flags->scene_path, "the scene, a .gltf or .glb file")->required();
  command->add_option("--scene", flags->load.scene, "which scene of the file")
      ->type_name("NAME|INDEX");
  command->add_flag("--allow-outside", flags->load.allow_outside,
                    "let URIs leave the scene's folder");
  command->add_flag("--json", flags->json, "as one JSON object");
  return {command, [flags] { return Info(*flags); }};
}

}  // namespace carpool::tools
