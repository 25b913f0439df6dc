// `hard-cases`: the suite of hard cases, its scenes as files, its figures as JSON.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "tests/hard_cases/figures.h"
#include "tests/hard_cases/scenes.h"
#include "tests/hard_cases/table.h"

namespace carpool::test {
namespace {

constexpr const char* kUsage =
    "usage: hard-cases [--full] [--write DIR | --table | --json FILE] [--gtest_filter=PATTERN "
    "...]\n"
    "  --full        with counts that take too long for the suite: 2^30 samples, 10^5 lights\n"
    "  --write DIR   writes every scene of the suite as glTF, with its sky, and how to render it\n"
    "  --table       prints how stable rays are at all scales and offsets, robust or not\n"
    "  --json FILE   runs the suite and writes what it measured\n";

void WriteAll(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (const SceneCase& scene : AllScenes()) {
    WriteCase(scene, folder);
    std::printf("%s\n", RenderCommand(scene, kFirstSeed).c_str());
  }
}

/// The scenes depend on it, and GoogleTest lists the scenes first of all.
void ReadLength(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) AtFullLength() |= std::string_view(argv[i]) == "--full";
}

int Run(int argc, char** argv) {
  ReadLength(argc, argv);
  testing::InitGoogleTest(&argc, argv);  // takes its own flags away
  std::string json;
  for (int i = 1; i < argc; ++i) {
    const std::string_view flag = argv[i];
    if (flag == "--full") continue;
    if (flag == "--write" && i + 1 < argc) {
      WriteAll(argv[i + 1]);
      return 0;
    }
    if (flag == "--table") {
      PrintTable();
      return 0;
    }
    if (flag == "--json" && i + 1 < argc) {
      json = argv[++i];
    } else {
      std::fputs(kUsage, stderr);
      return 2;
    }
  }
  const int code = RUN_ALL_TESTS();
  if (!json.empty()) std::ofstream(json) << tools::RowsJson(Figures());
  return code;
}

}  // namespace
}  // namespace carpool::test

int main(int argc, char** argv) {
  return carpool::test::Run(argc, argv);
}
