// Files and folders, by the standard library.
#include "files.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <fstream>
#include <string>
#include <system_error>

namespace fs = std::filesystem;

namespace {

bool is_image_name(const fs::path& path) {
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return suffix == ".png" || suffix == ".jpg" || suffix == ".jpeg";
}

bool are_same(const fs::path& a, const fs::path& b) {
  std::error_code missing;
  return fs::equivalent(a, b, missing) && !missing;
}

[[noreturn]] void throw_write_error(const fs::path& path, const std::error_code& error) {
  throw WriteError("cannot write " + path.string() + ": " + error.message() +
                   "; make room or name another folder");
}

}  // namespace

std::vector<FilePair> list_images(const fs::path& from, const fs::path& to) {
  if (are_same(from, to)) {
    throw std::invalid_argument("both folders are " + to.string() + "; name another for TO");
  }
  std::vector<FilePair> images;
  try {
    for (fs::recursive_directory_iterator at(from), end; at != end; ++at) {
      if (at->is_directory() && are_same(at->path(), to)) {
        at.disable_recursion_pending();
      } else if (at->is_regular_file() && is_image_name(at->path())) {
        const fs::path name = at->path().lexically_relative(from);
        images.push_back({.from = at->path(), .to = to / (name.string() + ".jpg")});
      }
    }
  } catch (const fs::filesystem_error& error) {
    throw ReadError("cannot read " + from.string() + ": " + error.code().message() +
                    "; name a folder that has images");
  }
  std::sort(images.begin(), images.end(),
            [](const FilePair& a, const FilePair& b) { return a.from < b.from; });
  return images;
}

bool is_up_to_date(const FilePair& files) {
  std::error_code none;  // to be made
  std::error_code gone;  // to be found bad
  const auto made = fs::last_write_time(files.to, none);
  const auto changed = fs::last_write_time(files.from, gone);
  return !none && !gone && made >= changed && fs::is_regular_file(files.to, none);
}

Bytes read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  Bytes bytes(in ? static_cast<std::size_t>(std::max<std::streamoff>(0, in.tellg())) : 0);
  in.seekg(0);
  if (!in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()))) {
    throw std::runtime_error("cannot be read");
  }
  return bytes;
}

void write_file(const fs::path& path, const Bytes& bytes) {
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  if (error) {
    throw_write_error(path.parent_path(), error);
  }
  fs::path part = path;
  part += ".part";
  errno = 0;
  std::ofstream out(part, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) {
    error = {errno != 0 ? errno : EIO, std::generic_category()};
  } else {
    fs::rename(part, path, error);
  }
  if (error) {
    std::error_code ignored;
    fs::remove(part, ignored);
    throw_write_error(path, error);
  }
}
