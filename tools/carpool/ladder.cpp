// `carpool ladder`: one image by every executor of the lecture, with its speed.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <span>
#include <string>

#include "render/ladder/ladder.h"
#include "render/posix/atomic_file.h"
#include "render/posix/interrupt.h"
#include "tools/carpool/commands.h"
#include "tools/carpool/render_flags.h"

namespace carpool::tools {
namespace {

struct LadderFlags : RenderFlags {
  render::LadderOptions options;
  std::string json_path, html_path;
};

void Save(const std::string& path, const std::string& text) {
  if (!path.empty()) render::WriteFileAtomically(path, std::as_bytes(std::span(text)));
}

render::ExitCode Climb(const LadderFlags& flags) {
  for (const std::string& path : {flags.json_path, flags.html_path}) {
    if (!path.empty()) render::CheckWritable(path);
  }
  render::RenderSettings settings = Settle(flags);
  if (!flags.samples) settings.samples = 16;
  if (flags.size.empty()) settings.width = settings.height = 256;
  const render::InterruptGuard interrupt;
  const auto say = [](const std::string& line) {
    std::fprintf(stderr, "carpool: %s\n", line.c_str());
  };
  const render::LadderReport report =
      render::RunLadder(settings, flags.options, interrupt.Requested(), say, Warn);
  std::fputs(report.Text().c_str(), stdout);
  Save(flags.json_path, report.Json());
  Save(flags.html_path, report.Html());
  return report.stopped ? render::ExitCode::interrupted : render::ExitCode::done;
}

}  // namespace

Command LadderCommand(CLI::App& program) {
  const auto flags = std::make_shared<LadderFlags>();
  CLI::App* command =
      program.add_subcommand("ladder",
                             "one image (256x256, 16 samples unless told otherwise) by every "
                             "executor from textbook recursion on");
  AddSceneFlags(*command, *flags);
  AddMachineFlags(*command, *flags);
  command
      ->add_option("--rounds", flags->options.rounds, "renders of each rung, in turn (default: 3)")
      ->type_name("N")
      ->check(CLI::Range(1, 1000));
  command
      ->add_option("--serial-seconds", flags->options.serial_seconds,
                   "skip serial rungs that would take longer than this in all (default: 60)")
      ->type_name("SECONDS")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--json", flags->json_path, "also write the figures to this file")
      ->type_name("FILE");
  command->add_option("--html", flags->html_path, "also write a page with bars to this file")
      ->type_name("FILE");
  return {command, [flags] { return Climb(*flags); }};
}

}  // namespace carpool::tools
