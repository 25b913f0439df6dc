// `carpool render`: a scene becomes an image, with progress on standard error.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>

#include "render/posix/interrupt.h"
#include "render/posix/terminal.h"
#include "render/session/session.h"
#include "tools/carpool/commands.h"
#include "tools/carpool/render_flags.h"

namespace carpool::tools {
namespace {

using render::InterruptGuard;
using render::ProgressStyle;
using render::TerminalColumns;

ProgressStyle StyleFor(bool quiet, int columns) {
  if (quiet) return ProgressStyle::silent;
  return columns > 0 ? ProgressStyle::bar : ProgressStyle::lines;
}

render::ExitCode RenderAndReport(const RenderFlags& flags) {
  const render::RenderSettings settings = Settle(flags);
  if (flags.explain) {
    std::fputs(render::ExplainSample(settings, NamedSample(flags), Warn).c_str(), stdout);
    return render::ExitCode::done;
  }
  const InterruptGuard interrupt;
  const int columns = TerminalColumns();
  render::ProgressPrinter progress(StyleFor(settings.quiet, columns), columns);
  const auto warn = [&progress](const std::string& line) {
    progress.Message("carpool: warning: " + line);
  };
  const render::RenderSummary summary =
      render::Render(settings, interrupt.Requested(), std::ref(progress), warn);
  progress.Finish();
  if (!settings.quiet) std::fputs(summary.Text().c_str(), stdout);
  return summary.code;
}

}  // namespace

Command RenderCommand(CLI::App& program) {
  const auto flags = std::make_shared<RenderFlags>();
  CLI::App* command = program.add_subcommand("render", "renders a scene into an OpenEXR image");
  AddSceneFlags(*command, *flags);
  AddRunFlags(*command, *flags);
  return {command, [flags] { return RenderAndReport(*flags); }};
}

}  // namespace carpool::tools
