// `carpool`: parses the command line, runs one command, turns whatever happens into an exit code.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "carpool/version.h"
#include "render/base/error.h"
#include "tools/carpool/commands.h"

namespace carpool::tools {
namespace {

using render::Error;
using render::ExitCode;

// An error is one line, whatever the message came from.
ExitCode Complain(ExitCode code, std::string line) {
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::fprintf(stderr, "carpool: %s\n", line.c_str());
  return code;
}

// What a person did wrong, better than CLI11 says it where no command was recognised.
std::string UsageLine(const CLI::App& program, const CLI::ParseError& error, int argc,
                      char** argv) {
  std::string commands;
  for (const CLI::App* command : program.get_subcommands({})) {
    if (command->parsed()) return std::string(error.what()) + "; see carpool --help";
    commands += (commands.empty() ? "" : ", ") + command->get_name();
  }
  const std::string given = argc > 1 ? "'" + std::string(argv[1]) + "' is no" : "missing a";
  return given + " command; use one of " + commands + ", or --help";
}

// Parses the arguments and runs the command they name.
ExitCode Run(CLI::App& program, const std::vector<Command>& commands, int argc, char** argv) {
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool asked_for_text = error.get_exit_code() == 0;  // --help, --version
    if (asked_for_text) return static_cast<ExitCode>(program.exit(error));
    return Complain(ExitCode::usage, UsageLine(program, error, argc, argv));
  }
  for (const Command& command : commands) {
    if (command.flags->parsed()) return command.run();
  }
  return ExitCode::usage;
}

ExitCode Main(int argc, char** argv) {
  CLI::App program("A progressive path tracer for glTF 2.0 scenes.", "carpool");
  program.set_version_flag("--version", "carpool " CARPOOL_VERSION);
  program.require_subcommand(1);
  const std::vector<Command> commands = {RenderCommand(program), PlanCommand(program),
                                         InfoCommand(program), LadderCommand(program)};
  const ExitCode code = Run(program, commands, argc, argv);
  if (std::fflush(stdout) != 0) throw render::OutputError("standard output", "cannot be written");
  return code;
}

}  // namespace

void Warn(const std::string& line) {
  std::fprintf(stderr, "carpool: warning: %s\n", line.c_str());
}

}  // namespace carpool::tools

int main(int argc, char** argv) {
  using namespace carpool::tools;
  const auto guarded = [&] {
    try {
      return Main(argc, argv);
    } catch (const Error& error) {
      return Complain(error.code(), error.what());
    } catch (const std::bad_alloc&) {
      return Complain(ExitCode::bad_input,
                      "out of memory; try a smaller --size or a smaller scene");
    } catch (const std::exception& error) {
      return Complain(ExitCode::bad_input, std::string("unexpected error: ") + error.what());
    }
  };
  return static_cast<int>(guarded());
}
