// Whether somebody watches standard error, and how wide their terminal is.
#pragma once

namespace carpool::render {

/// Columns of the terminal behind standard error; 0 if it is none, or too dumb to redraw a line.
int TerminalColumns();

}  // namespace carpool::render
