// What the progress display writes, and how often.
#include "render/session/progress.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace carpool::render {
namespace {

constexpr char kErase[] = "\r\033[K";

/// A stream in place of standard error, and what was written to it.
class Screen {
 public:
  std::FILE* stream() const { return file_.get(); }

  std::string Text() const {
    std::fflush(file_.get());
    std::rewind(file_.get());
    std::string text;
    for (int c = std::fgetc(file_.get()); c != EOF; c = std::fgetc(file_.get())) text += char(c);
    return text;
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_{std::tmpfile()};
};

std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::size_t Count(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++count;
  return count;
}

ProgressUpdate Rendering(double fraction, double elapsed_s) {
  return {.phase = ProgressPhase::render,
          .fraction = fraction,
          .samples_done = int(256 * fraction),
          .samples_total = 256,
          .elapsed_s = elapsed_s,
          .noise = 0.0123,
          .rays_per_second = 4.5e6};
}

TEST(Progress, SilentWritesNothing) {
  const Screen screen;
  ProgressPrinter progress(ProgressStyle::silent, 80, screen.stream());
  progress(Rendering(0.5, 1));
  progress.Message("a warning");
  progress.Finish();
  EXPECT_EQ(screen.Text(), "");
}

TEST(Progress, NothingBeforeTheFirstUpdate) {
  const Screen screen;
  ProgressPrinter progress(ProgressStyle::bar, 80, screen.stream());
  progress.Finish();
  EXPECT_EQ(screen.Text(), "");
}

TEST(Progress, LineShowsEveryNumberThatIsKnown) {
  const Screen screen;
  ProgressPrinter progress(ProgressStyle::lines, 80, screen.stream());
  progress(Rendering(0.5, 100));
  EXPECT_EQ(screen.Text(),
            "render  50 %  samples 128/256  1:40  ETA 1:40  noise 1.23 %  4.50 M rays/s\n");
}

TEST(Progress, UnknownNumbersAreLeftOut) {
  const Screen screen;
  ProgressPrinter progress(ProgressStyle::lines, 80, screen.stream());
  progress({.phase = ProgressPhase::load, .elapsed_s = 0.5});
  EXPECT_EQ(screen.Text(), "load  0.5 s\n");
}

TEST(Progress, EtaCountsFromThePhasesOwnStart) {
  const Screen screen;
  ProgressPrinter progress(ProgressStyle::lines, 80, screen.stream());
  progress({.phase = ProgressPhase::bvh, .elapsed_s = 0});
  progress(Rendering(0, 90));
  progress(Rendering(0.25, 100));
  progress.Finish();
  EXPECT_NE(screen.Text().find("1:40  ETA 30.0 s"), std::string::npos) << screen.Text();
}

TEST(Progress, LinesComeWithEachPhaseEveryFiveSecondsAndAtTheEnd) {
  const Screen screen;
  ProgressPrinter progress(ProgressStyle::lines, 80, screen.stream());
  progress({.phase = ProgressPhase::load, .elapsed_s = 0});
  for (int i = 0; i <= 1199; ++i) progress(Rendering(i / 1199.0, 1 + 0.01 * i));  // 1 to 12.99 s
  progress.Finish();
  const std::vector<std::string> lines = Lines(screen.Text());
  ASSERT_EQ(lines.size(), 5u) << screen.Text();  // load, 1 s, 6 s, 11 s, last
  EXPECT_NE(lines.back().find("samples 256/256"), std::string::npos) << lines.back();
  EXPECT_EQ(Count(screen.Text(), "\r"), 0u);
}

TEST(Progress, LinesTellHowAPhaseEnded) {
  const Screen screen;
  ProgressPrinter progress(ProgressStyle::lines, 80, screen.stream());
  progress(Rendering(0.25, 1));
  progress(Rendering(1, 2));  // too early for a line of its own
  progress({.phase = ProgressPhase::save, .elapsed_s = 2});
  const std::vector<std::string> lines = Lines(screen.Text());
  ASSERT_EQ(lines.size(), 3u) << screen.Text();
  EXPECT_NE(lines[1].find("samples 256/256"), std::string::npos) << lines[1];
}

TEST(Progress, BarIsRedrawnAtMostTenTimesASecond) {
  const Screen screen;
  ProgressPrinter progress(ProgressStyle::bar, 80, screen.stream());
  for (int i = 0; i <= 2000; ++i) progress(Rendering(i / 2000.0, 0.001 * i));  // two seconds
  const std::size_t drawn = Count(screen.Text(), "render");
  EXPECT_GE(drawn, 19u);
  EXPECT_LE(drawn, 21u);
}

TEST(Progress, BarFitsTheTerminal) {
  for (const int columns : {2, 20, 60, 80, 100, 300}) {
    const Screen screen;
    ProgressPrinter progress(ProgressStyle::bar, columns, screen.stream());
    progress(Rendering(0.5, 4000));
    progress.Finish();
    const std::string line = Lines(screen.Text()).at(0);
    EXPECT_LT(line.size(), std::size_t(columns)) << line;
    if (columns < 100) continue;
    const std::size_t full = Count(line, "#"), empty = line.find(']') - line.find_last_of('#') - 1;
    EXPECT_GE(full, 3u) << line;
    EXPECT_LE(std::max(full, empty) - std::min(full, empty), 1u) << line;  // half way
  }
}

TEST(Progress, NoBarWithoutAKnownFraction) {
  const Screen screen;
  ProgressPrinter progress(ProgressStyle::bar, 100, screen.stream());
  progress({.phase = ProgressPhase::save, .elapsed_s = 3});
  progress.Finish();
  EXPECT_EQ(screen.Text(), "save    3.0 s\n");
}

TEST(Progress, MessageLeavesTheBarWhole) {
  const Screen screen;
  ProgressPrinter progress(ProgressStyle::bar, 100, screen.stream());
  progress(Rendering(0.5, 1));
  const std::string bar = screen.Text();
  progress.Message("a warning");
  progress.Finish();
  EXPECT_EQ(screen.Text(), bar + kErase + "a warning\n" + bar + "\n");
}

TEST(Progress, FinishShowsTheLastUpdateOnceAndEndsTheLine) {
  const Screen screen;
  {
    ProgressPrinter progress(ProgressStyle::bar, 100, screen.stream());
    progress(Rendering(0.5, 1));
    progress(Rendering(1, 1.01));  // too early to be drawn
    progress.Finish();
    progress(Rendering(1, 9));  // too late
  }                             // the destructor has nothing left to do
  const std::string text = screen.Text();
  EXPECT_EQ(Count(text, "samples 256/256"), 1u) << text;
  EXPECT_EQ(Count(text, "\n"), 1u);
  EXPECT_EQ(text.back(), '\n');
}

TEST(Progress, ThreadsMayReportAtOnce) {
  const Screen screen;
  ProgressPrinter progress(ProgressStyle::lines, 80, screen.stream());
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&progress] {
      for (int i = 0; i < 500; ++i) progress(Rendering(0.5, 10.0 * i));
      progress.Message("a warning");
    });
  }
  for (std::thread& thread : threads) thread.join();
  progress.Finish();
  const std::vector<std::string> lines = Lines(screen.Text());
  EXPECT_GE(lines.size(), 500u + 4u);
  for (const std::string& line : lines) {
    EXPECT_TRUE(line == "a warning" || (line.starts_with("render") && line.ends_with("rays/s")))
        << line;
  }
}

}  // namespace
}  // namespace carpool::render
