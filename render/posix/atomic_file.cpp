// See atomic_file.h.
#include "render/posix/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "render/base/error.h"

namespace carpool::render {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void Fail(const fs::path& path, int error) {
  throw OutputError(path.string(), "cannot be written: " + std::generic_category().message(error));
}

/// Owns an open file.
class Descriptor {
 public:
  explicit Descriptor(int descriptor) : descriptor_(descriptor) {}
  ~Descriptor() { Close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  int Get() const { return descriptor_; }
  bool IsOpen() const { return descriptor_ >= 0; }
  void Reset(int descriptor) {
    Close();
    descriptor_ = descriptor;
  }
  /// False if the system reports a late write error.
  bool Close() {
    const int descriptor = std::exchange(descriptor_, -1);
    return descriptor < 0 || close(descriptor) == 0;
  }

 private:
  int descriptor_;
};

void WriteAll(const Descriptor& file, std::span<const std::byte> contents, const fs::path& path) {
  while (!contents.empty()) {
    const ssize_t written = write(file.Get(), contents.data(), contents.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) Fail(path, errno);
    contents = contents.subspan(static_cast<size_t>(written));
  }
}

/// A new file beside the target, removed again unless it takes the target's place.
class TemporaryFile {
 public:
  explicit TemporaryFile(const fs::path& target) : target_(target) {
    static std::atomic<unsigned> counter{0};
    do {
      path_ = target;
      path_ += ".tmp-" + std::to_string(getpid()) + "-" + std::to_string(counter++);
      file_.Reset(open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    } while (!file_.IsOpen() && errno == EEXIST);
    if (!file_.IsOpen()) Fail(target, errno);
  }
  ~TemporaryFile() {
    if (!path_.empty()) unlink(path_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void Replace(std::span<const std::byte> contents) {
    WriteAll(file_, contents, target_);
    KeepPermissions();
    if (fsync(file_.Get()) != 0 || !file_.Close()) Fail(target_, errno);
    if (rename(path_.c_str(), target_.c_str()) != 0) Fail(target_, errno);
    path_.clear();
    SyncFolder();
  }

 private:
  /// Of the file to be replaced, where the file system can.
  void KeepPermissions() const {
    struct stat old {};
    if (stat(target_.c_str(), &old) == 0 && fchmod(file_.Get(), old.st_mode & 0777) != 0) errno = 0;
  }

  /// Makes the rename itself durable. Some file systems cannot, which is no reason to fail.
  void SyncFolder() const {
    const fs::path folder = target_.has_parent_path() ? target_.parent_path() : fs::path(".");
    const Descriptor opened(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (opened.IsOpen() && fsync(opened.Get()) != 0) errno = 0;
  }

  fs::path target_;
  fs::path path_;
  Descriptor file_{-1};
};

/// Where the file really is: links are followed, so that they stay.
fs::path Resolve(const fs::path& path) {
  std::error_code error;
  fs::path resolved = fs::weakly_canonical(path, error);
  return error ? path : resolved;
}

/// Devices and pipes (/dev/null, /dev/stdout) exist but are no regular files: renaming would
/// destroy them.
bool IsDevice(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status)) Fail(path, EISDIR);
  return fs::exists(status) && !fs::is_regular_file(status);
}

}  // namespace

void WriteFileAtomically(const fs::path& path, std::span<const std::byte> contents) {
  if (IsDevice(path)) {
    const Descriptor device(open(path.c_str(), O_WRONLY | O_CLOEXEC));
    if (!device.IsOpen()) Fail(path, errno);
    WriteAll(device, contents, path);
    return;
  }
  TemporaryFile(Resolve(path)).Replace(contents);
}

void CheckWritable(const fs::path& path) {
  if (IsDevice(path)) {
    if (access(path.c_str(), W_OK) != 0) Fail(path, errno);
    return;
  }
  const TemporaryFile probe(Resolve(path));
}

}  // namespace carpool::render
