// See idle_cost.h.
#include "idle_cost.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <system_error>
#include <thread>

namespace carpool_stress {
namespace {

using std::chrono::steady_clock;

double seconds_since(steady_clock::time_point begin) {
  return std::chrono::duration<double>(steady_clock::now() - begin).count();
}

double process_cpu_seconds() {
  std::timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double look() {
  const steady_clock::time_point begin = steady_clock::now();
  const double cpu = process_cpu_seconds();
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  return (process_cpu_seconds() - cpu) / seconds_since(begin);
}

// Nanoseconds on a processor by thread: the first number of Linux's schedstat.
std::map<std::string, std::uint64_t> thread_times() {
  std::map<std::string, std::uint64_t> times;
  std::error_code gone;  // a thread may end while this looks
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task", gone)) {
    std::ifstream file(entry.path() / "schedstat");
    if (std::uint64_t time = 0; file >> time) times[entry.path().filename().string()] = time;
  }
  return times;
}

// As proc(5) has it: R runs or wants to, S sleeps.
char state_of(const std::string& thread) {
  std::ifstream file("/proc/self/task/" + thread + "/stat");
  std::string line;
  std::getline(file, line);
  const std::size_t name_end = line.rfind(')');
  return name_end == std::string::npos || name_end + 2 >= line.size() ? '?' : line[name_end + 2];
}

}  // namespace

double least_cpu_share(double limit) {
  constexpr double kQuiet = 0.01;
  constexpr int kLooks = 50, kMostLooks = 400;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMostLooks && least > (i < kLooks ? kQuiet : limit); ++i)
    least = std::min(least, look());
  return least;
}

std::string busy_threads() {
  const std::map<std::string, std::uint64_t> before = thread_times();
  const steady_clock::time_point begin = steady_clock::now();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const std::map<std::string, std::uint64_t> after = thread_times();
  const double seconds = seconds_since(begin);
  std::string text;
  for (const auto& [thread, time] : after) {
    const auto found = before.find(thread);
    const std::uint64_t used = found == before.end() ? time : time - found->second;
    const int percent = static_cast<int>(static_cast<double>(used) * 1e-7 / seconds);
    if (percent < 1) continue;
    text += (text.empty() ? "thread " : ", ") + thread + " (" + state_of(thread) + ") " +
            std::to_string(percent) + " %";
  }
  return text.empty() ? "no thread" : text;
}

}  // namespace carpool_stress
