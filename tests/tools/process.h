// Runs a program as a person would: arguments in, two streams, an exit code, signals on the way.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace carpool::tests {

struct Outcome {
  int exit_code = -1;  // 128 + N if signal N ended it
  std::string out, err;
};

/// A running program, its streams going to files of their own, its standard input empty. Ended by
/// force if it still runs when this goes away, or after two minutes in Wait().
class Process {
 public:
  /// `arguments[0]` is the program's path. `stdout_file` may name something to write to instead.
  explicit Process(const std::vector<std::string>& arguments, std::string stdout_file = "");
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void Signal(int signal) const;

  /// WaitForError returns once standard error holds `text`; false if the program ended before.
  bool WaitForError(const std::string& text);

  /// Wait returns when the program has ended.
  Outcome Wait();

 private:
  bool HasEnded();

  std::filesystem::path folder_;
  std::string stdout_file_;
  int pid_ = -1;
  int status_ = 0;
  bool ended_ = false;
};

/// A folder that is gone with everything in it when this is.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

  /// Files returns the names in the folder, sorted.
  std::vector<std::string> Files() const;

 private:
  std::filesystem::path path_;
};

std::string ReadFile(const std::string& path);
void WriteFile(const std::string& path, const std::string& bytes);

}  // namespace carpool::tests
