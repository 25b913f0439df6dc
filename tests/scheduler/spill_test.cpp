// Blocks beyond the memory bound go to a file and come back, every one of them, under one bound.
#include <gtest/gtest.h>

#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <system_error>

#include "allocations.h"
#include "carpool/carpool.h"
#include "random_graph.h"

namespace {

using carpool_test::RandomGraph;
using carpool_test::Shape;

struct Setting {
  carpool::RunMode mode;
  std::uint32_t threads;
};

class SpillTest : public testing::TestWithParam<Setting> {
 protected:
  carpool::RunOptions options() const {
    return {.threads = GetParam().threads,
            .in_flight = 40,
            .mode = GetParam().mode,
            .overflow = carpool::Overflow::spill};
  }
};

// Every source item becomes 200 at once, though it was declared to stay one.
Shape flood(std::uint64_t seed) {
  return {.seed = seed,
          .stages = 3,
          .most_bins = seed % 2 == 0 ? 4U : 60U,
          .block_items = seed % 3 == 0 ? 1U : 8U,
          .items = 100,
          .most_hops = 4,
          .fan_out = 200,
          .split_early = true,
          .caps = seed % 4 == 1,
          .blocking = seed % 4 == 2,
          .undeclared = true};
}

TEST_P(SpillTest, EverythingComesBackAndMemoryStaysBounded) {
  std::uint64_t spilled = 0;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomGraph random(flood(seed));
    carpool::RunOptions spilling = options();
    spilling.simulation.seed = seed;
    const auto report = carpool::run(random.graph(), spilling);
    ASSERT_EQ(random.counted(), random.expected());
    ASSERT_TRUE(random.caps_held());
    ASSERT_LE(report.peak_bytes, report.worst_case_bytes);
    ASSERT_EQ(report.worst_case_bytes, carpool::worst_case_bytes(random.graph(), spilling));
    ASSERT_EQ(report.overflow_blocks, 0U);
    ASSERT_EQ(report.dropped_items, 0U);
    spilled += report.spilled_blocks;
  }
  EXPECT_GT(spilled, 1000U);  // or there was nothing to test
}

TEST_P(SpillTest, AnExceptionEndsTheRun) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    RandomGraph random(flood(seed));
    std::atomic<std::uint64_t> left{seed * 20};
    random.on_batch = [&] {
      if (left.fetch_sub(1) == 0) {
        throw seed;
      }
    };
    EXPECT_THROW(carpool::run(random.graph(), options()), std::uint64_t);
  }
}

// What was neither run nor thrown away is counted as dropped.
TEST_P(SpillTest, CancelDropsWhatIsInTheFile) {
  RandomGraph random(flood(4));
  carpool::RunOptions spilling = options();
  spilling.cancel = carpool::CancelToken();
  std::atomic<int> batches{0};
  random.on_batch = [&] {
    if (++batches == 200) {
      spilling.cancel.cancel();
    }
  };
  const auto report = carpool::run(random.graph(), spilling);
  EXPECT_EQ(report.outcome, carpool::Outcome::cancelled);
  EXPECT_GT(report.dropped_items, 0U);
}

std::string name_of(const testing::TestParamInfo<Setting>& info) {
  constexpr const char* kModes[] = {"threads", "serial", "simulated"};
  return kModes[static_cast<int>(info.param.mode)] + std::to_string(info.param.threads);
}

INSTANTIATE_TEST_SUITE_P(Modes, SpillTest,
                         testing::Values(Setting{carpool::RunMode::serial, 0},
                                         Setting{carpool::RunMode::threads, 1},
                                         Setting{carpool::RunMode::threads, 2},
                                         Setting{carpool::RunMode::threads, 8},
                                         Setting{carpool::RunMode::simulated, 5}),
                         name_of);

carpool::RunOptions small_options() {
  return {.threads = 2, .in_flight = 40, .overflow = carpool::Overflow::spill};
}

std::string error_of(const carpool::RunOptions& options) {
  RandomGraph random(flood(2));
  try {
    carpool::run(random.graph(), options);
  } catch (const std::system_error& error) {
    return error.what();
  }
  return "no error";
}

TEST(SpillTest, AFolderThatIsNotThereIsReported) {
  carpool::RunOptions options = small_options();
  options.spill_folder = "/no/such/folder";
  const std::string error = error_of(options);
  EXPECT_NE(error.find("'/no/such/folder'"), std::string::npos) << error;
  EXPECT_NE(error.find("spill_folder"), std::string::npos) << error;
}

// FileSizeLimit makes files end where a full disk would.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{.rlim_cur = bytes, .rlim_max = before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, SIG_DFL);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
};

TEST(SpillTest, AFullDiskEndsTheRunWithOneLine) {
  const FileSizeLimit limit(4096);
  const std::string error = error_of(small_options());
  EXPECT_NE(error.find("cannot write"), std::string::npos) << error;
  EXPECT_EQ(error.find('\n'), std::string::npos) << error;
}

TEST(SpillTest, NothingIsLeftInTheFolder) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "carpool_spill_test";
  std::filesystem::create_directory(folder);
  RandomGraph random(flood(2));
  bool seen = false;
  random.on_batch = [&] { seen = seen || !std::filesystem::is_empty(folder); };
  carpool::RunOptions options = small_options();
  options.mode = carpool::RunMode::serial;
  options.spill_folder = folder;
  carpool::run(random.graph(), options);
  EXPECT_FALSE(seen);  // not even during the run
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  std::filesystem::remove(folder);
}

// The file's length costs no memory: an index of it would show here.
TEST(SpillTest, MemoryFromTheSystemStaysWithinTheFormula) {
  if (!carpool_test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer counts allocations itself";
  }
  Shape shape = flood(2);
  shape.blocking = false;
  shape.fan_out = 5000;
  RandomGraph random(shape);
  carpool::RunOptions options = small_options();
  options.mode = carpool::RunMode::serial;
  const std::size_t before = carpool_test::live_bytes();
  carpool_test::reset_peak_live_bytes();
  const auto report = carpool::run(random.graph(), options);
  EXPECT_GT(report.peak_spill_bytes, 4 * report.worst_case_bytes);
  EXPECT_LE(carpool_test::peak_live_bytes() - before, report.worst_case_bytes + 65536);
}

}  // namespace
