// Whole files into memory: regular files only, sized before anything is allocated.
#include "render/gltf/files.h"

#include <algorithm>
#include <fstream>
#include <system_error>

#include "render/base/error.h"

namespace carpool::render::gltf {

void ByteBudget::Take(uint64_t bytes, const std::string& where) {
  if (bytes > left) {
    throw InputError(where, "the scene's files hold more bytes than the limit of " +
                                std::to_string((left + taken) >> 20) +
                                " MiB allows; use smaller textures or split the scene");
  }
  left -= bytes;
  taken += bytes;
}

uint64_t HalfOfMemory() {
  std::ifstream stream("/proc/meminfo");
  std::string label;
  uint64_t kib = 0;
  if (stream >> label >> kib && label == "MemTotal:" && kib > 0) return kib * 512;
  return uint64_t{4} << 30;
}

std::vector<std::byte> ReadFile(const std::filesystem::path& path, const std::string& where,
                                ByteBudget& budget, uint64_t at_most) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) {
    throw InputError(where, "file '" + path.string() + "' does not exist; check the name");
  }
  // Devices and pipes have no size to check and may block or never end.
  if (!error && status.type() != fs::file_type::regular) {
    throw InputError(where, "'" + path.string() + "' is not a regular file; name a file");
  }
  const uint64_t size = error ? 0 : fs::file_size(path, error);
  std::ifstream stream(path, std::ios::binary);
  if (error || !stream) {
    throw InputError(where, "file '" + path.string() + "' cannot be read; check its permissions");
  }
  const uint64_t wanted = std::min(size, at_most);
  budget.Take(wanted, where);
  budget.read += wanted;
  std::vector<std::byte> bytes(wanted);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(wanted));
  if (static_cast<uint64_t>(stream.gcount()) != wanted) {
    throw InputError(where, "file '" + path.string() + "' ended early; was it changed meanwhile?");
  }
  return bytes;
}

}  // namespace carpool::render::gltf
