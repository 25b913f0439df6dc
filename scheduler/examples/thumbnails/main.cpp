// thumbnails: a folder of thousands of images, in bounded memory, resumable.
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>

#include "thumbnails.h"

namespace {

const carpool::CancelToken interrupted;

extern "C" void on_signal(int) {
  interrupted.cancel();
}

int usage() {
  std::fprintf(stderr,
               "usage: thumbnails FROM TO [--size PIXELS] [--threads N] [--readers N] "
               "[--in-flight IMAGES] [--quiet]\n");
  return 2;
}

// A bar that stays on its line.
void show_progress(std::uint64_t done, std::uint64_t all) {
  constexpr int kWidth = 40;
  const int filled = all == 0 ? kWidth : static_cast<int>(done * kWidth / all);
  std::fprintf(stderr, "\r[%.*s%*s] %llu of %llu", filled,
               "########################################", kWidth - filled, "",
               static_cast<unsigned long long>(done), static_cast<unsigned long long>(all));
}

// Exit codes: 0 done, 1 some files were bad, 3 the folder cannot be read, or 4 not be written to,
// 130 interrupted.
int make(const ThumbnailOptions& options, bool quiet) {
  const ThumbnailSummary summary = make_thumbnails(options);
  if (!quiet) {
    std::fprintf(stderr, "\r\033[K");
    std::printf("%llu made, %llu up to date, %llu bad, %llu left\n",
                static_cast<unsigned long long>(summary.made),
                static_cast<unsigned long long>(summary.up_to_date),
                static_cast<unsigned long long>(summary.bad),
                static_cast<unsigned long long>(summary.left));
  }
  return summary.left != 0 ? 130 : summary.bad != 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    return usage();
  }
  ThumbnailOptions options{.from = argv[1], .to = argv[2]};
  bool quiet = false;
  for (int i = 3; i < argc; ++i) {
    std::uint32_t* const value = std::strcmp(argv[i], "--size") == 0        ? &options.size
                                 : std::strcmp(argv[i], "--threads") == 0   ? &options.run.threads
                                 : std::strcmp(argv[i], "--readers") == 0   ? &options.readers
                                 : std::strcmp(argv[i], "--in-flight") == 0 ? &options.in_flight
                                                                            : nullptr;
    if (std::strcmp(argv[i], "--quiet") == 0) {
      quiet = true;
    } else if (value != nullptr && i + 1 < argc) {
      *value = static_cast<std::uint32_t>(std::strtoul(argv[++i], nullptr, 10));
    } else {
      return usage();
    }
  }
  if (options.size == 0 || options.in_flight == 0) {
    return usage();
  }
  options.on_bad = [](const std::filesystem::path& path, const std::string& reason) {
    std::fprintf(stderr, "\r\033[Kthumbnails: skipped %s: %s\n", path.c_str(), reason.c_str());
  };
  if (!quiet) {
    options.on_progress = show_progress;
  }
  options.run.cancel = interrupted;
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  if (!std::filesystem::is_directory(options.from)) {
    std::fprintf(stderr, "thumbnails: %s is no folder; name one that has images\n", argv[1]);
    return 3;
  }
  try {
    return make(options, quiet);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "thumbnails: %s\n", error.what());
    return 4;
  }
}
