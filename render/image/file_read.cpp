// See file_read.h.
#include "render/image/file_read.h"

#include <cerrno>
#include <fstream>
#include <system_error>

#include "render/base/error.h"

namespace carpool::render {

std::vector<std::byte> ReadWholeFile(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) throw InputError(path.string(), "no such file");
  if (!std::filesystem::is_regular_file(status)) {
    throw InputError(path.string(), "is not a regular file");
  }
  const uintmax_t size = std::filesystem::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  if (error || !file) {
    throw InputError(path.string(), "cannot be read: " + std::generic_category().message(errno));
  }
  std::vector<std::byte> bytes(size);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (static_cast<uintmax_t>(file.gcount()) != size) {
    throw InputError(path.string(), "cannot be read in full");
  }
  return bytes;
}

}  // namespace carpool::render
