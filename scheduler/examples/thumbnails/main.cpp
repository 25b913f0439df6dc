// thumbnails: a folder of thousands of images, in bounded memory, resumable.
#include <unistd.h>

#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <optional>

#include "files.h"
#include "thumbnails.h"

namespace {

const char kHelp[] =
    "usage: thumbnails FROM TO [options]\n"
    "\n"
    "Makes a JPEG no larger than 256x256 pixels of every PNG and JPEG below the folder FROM:\n"
    "FROM/a/b.png becomes TO/a/b.png.jpg. What is there and newer than its image is left alone,\n"
    "so that it may be interrupted and started again. Bad files are named, and skipped.\n"
    "\n"
    "  --size PIXELS       of the longer side (256); thumbnails of another size are not made anew\n"
    "  --threads N         that decode, shrink and encode (as many as there are cores)\n"
    "  --readers N         threads that read, and half as many that write (4)\n"
    "  --in-flight IMAGES  in memory at once (32)\n"
    "  --quiet             no progress\n"
    "\n"
    "Exit codes: 0 done, 1 some files were bad, 2 the command line is wrong, 3 FROM cannot be\n"
    "read, 4 TO cannot be written, 130 interrupted.\n";

struct Command {
  ThumbnailOptions options;
  bool quiet = false;
};

const carpool::CancelToken interrupted;

extern "C" void on_signal(int) {
  interrupted.cancel();
}

std::nullopt_t wrong(const char* what, const char* argument) {
  std::fprintf(stderr, "thumbnails: %s %s; see thumbnails --help\n", what, argument);
  return std::nullopt;
}

bool parse(const char* text, std::uint32_t& value) {
  constexpr std::uint32_t kMost = 65536;
  const char* const end = text + std::strlen(text);
  const auto [rest, error] = std::from_chars(text, end, value);
  return error == std::errc() && rest == end && value > 0 && value <= kMost;
}

std::optional<Command> parse(int argc, char** argv) {
  Command command;
  ThumbnailOptions& options = command.options;
  for (int i = 1; i < argc; ++i) {
    const auto is = [&](const char* flag) { return std::strcmp(argv[i], flag) == 0; };
    std::uint32_t* const value = is("--size")        ? &options.size
                                 : is("--threads")   ? &options.run.threads
                                 : is("--readers")   ? &options.readers
                                 : is("--in-flight") ? &options.in_flight
                                                     : nullptr;
    if (is("--quiet")) {
      command.quiet = true;
    } else if (value != nullptr) {
      if (i + 1 == argc || !parse(argv[i + 1], *value)) {
        return wrong("a number from 1 to 65536 is missing after", argv[i]);
      }
      ++i;
    } else if (argv[i][0] == '-' || (!options.from.empty() && !options.to.empty())) {
      return wrong("does not know what to do with", argv[i]);
    } else {
      (options.from.empty() ? options.from : options.to) = argv[i];
    }
  }
  if (options.to.empty()) {
    return wrong("missing:", options.from.empty() ? "FROM and TO" : "TO");
  }
  return command;
}

// Progress shows a bar on a terminal, elsewhere a line for every tenth.
class Progress {
 public:
  void show(std::uint64_t done, std::uint64_t all) {
    if (all != 0 && is_terminal_) {
      show_bar(done, all);
    } else if (all != 0 && done * 10 / all > tenths_) {
      tenths_ = done * 10 / all;
      std::fprintf(stderr, "thumbnails: %llu of %llu\n", number(done), number(all));
    }
  }
  void clear() const {
    if (is_terminal_) {
      std::fprintf(stderr, "\r\033[K");
    }
  }
  static unsigned long long number(std::uint64_t value) { return value; }

 private:
  using Clock = std::chrono::steady_clock;

  void show_bar(std::uint64_t done, std::uint64_t all) const {
    constexpr std::uint64_t kWidth = 40;
    const int filled = static_cast<int>(done * kWidth / all);
    const double seconds = std::chrono::duration<double>(Clock::now() - began_).count();
    std::fprintf(stderr, "\r[%.*s%*s] %llu of %llu", filled,
                 "########################################", static_cast<int>(kWidth) - filled, "",
                 number(done), number(all));
    if (done != 0) {
      std::fprintf(stderr, ", %.0f s left\033[K",
                   seconds * static_cast<double>(all - done) / static_cast<double>(done));
    }
  }

  const bool is_terminal_ = isatty(STDERR_FILENO) != 0;
  const Clock::time_point began_ = Clock::now();
  std::uint64_t tenths_ = 0;
};

int make(Command& command) {
  Progress progress;
  command.options.on_bad = [&](const std::filesystem::path& path, const std::string& reason) {
    progress.clear();
    std::fprintf(stderr, "thumbnails: skipped %s: %s\n", path.c_str(), reason.c_str());
  };
  if (!command.quiet) {
    command.options.on_progress = [&](std::uint64_t done, std::uint64_t all) {
      progress.show(done, all);
    };
  }
  const ThumbnailSummary summary = make_thumbnails(command.options);
  if (!command.quiet) {
    progress.clear();
  }
  std::printf("%llu made, %llu up to date, %llu bad, %llu left\n", Progress::number(summary.made),
              Progress::number(summary.up_to_date), Progress::number(summary.bad),
              Progress::number(summary.left));
  return summary.left != 0 ? 130 : summary.bad != 0 ? 1 : 0;
}

int fail(int code, const std::exception& error) {
  std::fprintf(stderr, "thumbnails: %s\n", error.what());
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--help") == 0) {
      std::fputs(kHelp, stdout);
      return 0;
    }
  }
  std::optional<Command> command = parse(argc, argv);
  if (!command) {
    return 2;
  }
  command->options.run.cancel = interrupted;
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  try {
    return make(*command);
  } catch (const std::invalid_argument& error) {
    return fail(2, error);
  } catch (const ReadError& error) {
    return fail(3, error);
  } catch (const std::exception& error) {
    return fail(4, error);
  }
}
