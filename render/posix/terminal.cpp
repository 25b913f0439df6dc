// Asks the terminal behind standard error for its size.
#include "render/posix/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>
#include <cstdlib>
#include <string_view>

namespace carpool::render {

int TerminalColumns() {
  const char* kind = std::getenv("TERM");
  if (!isatty(STDERR_FILENO) || kind == nullptr || std::string_view(kind) == "dumb") return 0;
  winsize size = {};
  const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : 80;
}

}  // namespace carpool::render
