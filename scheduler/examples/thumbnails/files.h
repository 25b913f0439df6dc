// Which files there are, and how they are read and written.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <vector>

#include "image.h"

struct FilePair {
  std::filesystem::path from;
  std::filesystem::path to;
};

// What ends a run, each a line that says what is wrong and where.
struct ReadError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
struct WriteError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// list_images finds every .png, .jpg and .jpeg below `from`, in the order of their names, but not
/// in `to`, should that be below it. Throws ReadError if a folder cannot be read, and
/// std::invalid_argument if both are the same.
std::vector<FilePair> list_images(const std::filesystem::path& from,
                                  const std::filesystem::path& to);

/// is_up_to_date tells whether there is a thumbnail that is newer than its image.
bool is_up_to_date(const FilePair& files);

/// read_file returns all bytes. Throws std::runtime_error.
Bytes read_file(const std::filesystem::path& path);

/// write_file writes under another name and renames then: who sees the name sees the whole file.
/// Makes folders that are missing. Throws WriteError, and leaves nothing half done.
void write_file(const std::filesystem::path& path, const Bytes& bytes);
