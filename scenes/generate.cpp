// generate-scenes: writes one of this project's scenes, or all of the small ones.
#include <charconv>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string>
#include <string_view>

#include "scenes/scenes.h"

namespace {

namespace fs = std::filesystem;
using namespace carpool::scenes;

constexpr char kUsage[] =
    "usage: generate-scenes small FOLDER              cornell_box, furnace and materials as .gltf\n"
    "       generate-scenes instances FILE [COUNT]    COUNT balls of 7,200 triangles (1000)\n"
    "       generate-scenes lights FILE [COUNT]       COUNT emissive triangles (100000)\n"
    "       generate-scenes textures FILE [COUNT]     COUNT textured materials (64)\n"
    "FILE ends in .glb or .gltf.\n";

constexpr int kMostItems = 10'000'000;

/// The third argument, `otherwise` where there is none, or 0 where it is no count.
int ReadCount(int argc, char** argv, int otherwise) {
  if (argc < 4) return otherwise;
  const std::string_view text = argv[3];
  int count = 0;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), count);
  const bool good = parsed.ec == std::errc() && parsed.ptr == text.data() + text.size();
  return good && count > 0 && count <= kMostItems ? count : 0;
}

void WriteSmall(const fs::path& folder) {
  fs::create_directories(folder);
  CornellBox().Write(folder / "cornell_box.gltf");
  Furnace().Write(folder / "furnace.gltf");
  Materials().Write(folder / "materials.gltf");
}

/// Writes what the command line names; false where it is wrong.
bool Generate(int argc, char** argv) {
  if (argc < 3 || argc > 4) return false;
  const std::string name = argv[1];
  const fs::path path = argv[2];
  if (name == "small") return argc == 3 && (WriteSmall(path), true);
  if (path.extension() != ".glb" && path.extension() != ".gltf") return false;
  const int count = ReadCount(argc, argv,
                              name == "instances" ? 1000
                              : name == "lights"  ? 100'000
                                                  : 64);
  if (count == 0) return false;
  if (name == "instances") return Instances(count).Write(path), true;
  if (name == "lights") return Lights(count).Write(path), true;
  if (name == "textures") return Textures(count).Write(path), true;
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (Generate(argc, argv)) return 0;
  } catch (const std::exception& error) {
    std::cerr << "generate-scenes: " << error.what() << "; choose another place\n";
    return 4;
  }
  std::cerr << kUsage;
  return 2;
}
