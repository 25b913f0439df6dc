// Opening, reading and writing a file without a name.
#include "posix/temporary_file.h"

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

namespace carpool {
namespace {

// Not every file system has files without names; elsewhere one is made and its name removed.
int open_unnamed(const std::filesystem::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (descriptor >= 0 || (errno != EOPNOTSUPP && errno != EISDIR && errno != EINVAL)) {
    return descriptor;
  }
  std::string name = folder / "carpool-spill-XXXXXX";
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) {
    ::unlink(name.c_str());
  }
  return named;
}

}  // namespace

TemporaryFile::TemporaryFile(std::filesystem::path folder) : folder_(std::move(folder)) {
  descriptor_ = open_unnamed(folder_);
  if (descriptor_ < 0) {
    fail(errno, "cannot make a file");
  }
}

TemporaryFile::~TemporaryFile() {
  ::close(descriptor_);
}

void TemporaryFile::write(std::uint64_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t done =
        ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (done < 0 && errno != EINTR) {
      fail(errno, "cannot write");
    }
    const auto count = static_cast<std::size_t>(done < 0 ? 0 : done);
    offset += count;
    bytes = bytes.subspan(count);
  }
}

void TemporaryFile::read(std::uint64_t offset, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t done =
        ::pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (done == 0 || (done < 0 && errno != EINTR)) {
      fail(done == 0 ? EIO : errno, "cannot read back");
    }
    const auto count = static_cast<std::size_t>(done < 0 ? 0 : done);
    offset += count;
    bytes = bytes.subspan(count);
  }
}

void TemporaryFile::fail(int error, const char* what) const {
  throw std::system_error(error, std::generic_category(),
                          std::string("carpool: ") + what + " in the spill folder '" +
                              folder_.string() +
                              "'; give it room, or choose another RunOptions::spill_folder");
}

}  // namespace carpool
