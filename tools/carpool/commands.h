// The commands of `carpool`: each file beside this one adds one.
#pragma once

#include <functional>
#include <string>

#include "render/base/error.h"

namespace CLI {
class App;
}

namespace carpool::tools {

/// One command of the program: its flags, and what it does once they are parsed. An error is thrown
/// as render::Error; results go to standard output.
struct Command {
  CLI::App* flags;
  std::function<render::ExitCode()> run;
};

/// Warn prints a warning on standard error.
void Warn(const std::string& line);

Command RenderCommand(CLI::App& program);
Command PlanCommand(CLI::App& program);
Command InfoCommand(CLI::App& program);
Command LadderCommand(CLI::App& program);

}  // namespace carpool::tools
