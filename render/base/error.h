// Errors and warnings as a user sees them: one line that says what, where and what to do.
#pragma once

#include <functional>
#include <stdexcept>
#include <string>

namespace carpool::render {

/// Exit codes of the programs; scripts rely on them.
enum class ExitCode : int {
  done = 0,
  no = 1,             // the question's answer is no
  usage = 2,          // the command line is wrong
  bad_input = 3,      // the input is bad
  output_failed = 4,  // the output could not be written
  interrupted = 130,  // stopped by a signal, what was rendered is saved
};

/// Thrown for anything a user can mend. `what()` is one line: "FILE: /json/pointer: what is wrong;
/// what to do".
class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& line) : std::runtime_error(line), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

/// The input is bad. `where` is a file name, with a JSON pointer after it if the file is glTF.
class InputError : public Error {
 public:
  InputError(const std::string& where, const std::string& what)
      : Error(ExitCode::bad_input, where + ": " + what) {}
};

/// The output could not be written.
class OutputError : public Error {
 public:
  OutputError(const std::string& where, const std::string& what)
      : Error(ExitCode::output_failed, where + ": " + what) {}
};

/// Receives one-line warnings; must be callable from any thread.
using WarningSink = std::function<void(const std::string&)>;

}  // namespace carpool::render
