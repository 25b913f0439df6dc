// Whole files into memory, with a limit and an error that says what to do.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

namespace carpool::render::gltf {

/// Bytes that may still be read; shared by all files of a scene, so that no list of large files
/// adds up.
struct ByteBudget {
  uint64_t left = std::numeric_limits<uint64_t>::max();
  uint64_t taken = 0;
  uint64_t read = 0;  // of `taken`, what came from files rather than from copies within them

  /// Take() subtracts, or throws InputError where less is left.
  void Take(uint64_t bytes, const std::string& where);
};

/// HalfOfMemory() is half of what this machine has, in bytes; 4 GiB where it does not say.
uint64_t HalfOfMemory();

/// ReadFile() reads the first `at_most` bytes of a regular file, all by default.
std::vector<std::byte> ReadFile(const std::filesystem::path& path, const std::string& where,
                                ByteBudget& budget,
                                uint64_t at_most = std::numeric_limits<uint64_t>::max());

}  // namespace carpool::render::gltf
