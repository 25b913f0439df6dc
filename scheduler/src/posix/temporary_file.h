// A file without a name, which is gone when it is closed or the process ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace carpool {

// TemporaryFile reads and writes at offsets. Errors are std::system_error: what, where (the
// folder), and what to do. Thread-safe, as pread and pwrite are.
class TemporaryFile {
 public:
  explicit TemporaryFile(std::filesystem::path folder);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void write(std::uint64_t offset, std::span<const std::byte> bytes);
  void read(std::uint64_t offset, std::span<std::byte> bytes) const;

 private:
  [[noreturn]] void fail(int error, const char* what) const;

  std::filesystem::path folder_;
  int descriptor_ = -1;
};

}  // namespace carpool
