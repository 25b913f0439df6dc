// The outer layer of a scene file: magic numbers, GLB chunks and their lengths.
#include "render/gltf/container.h"

#include <cstdint>
#include <cstring>

#include "render/base/error.h"

namespace carpool::render::gltf {
namespace {

constexpr uint32_t kGlbMagic = 0x46546C67;   // "glTF"
constexpr uint32_t kJsonChunk = 0x4E4F534A;  // "JSON"
constexpr uint32_t kBinChunk = 0x004E4942;   // "BIN\0"
constexpr uint64_t kGlbHeader = 12;
constexpr uint64_t kChunkHeader = 8;
constexpr int kDeepest = 128;

uint32_t ReadWord(std::span<const std::byte> bytes, uint64_t offset) {
  uint32_t word;  // GLB is little-endian, as are the machines this runs on
  std::memcpy(&word, bytes.data() + offset, sizeof word);
  return word;
}

std::string_view AsText(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// The chunk at `offset`, whose header and length are checked against the file.
std::span<const std::byte> ReadChunk(std::span<const std::byte> file, uint64_t offset,
                                     const std::string& name) {
  const uint64_t length = ReadWord(file, offset);
  if (length > file.size() - offset - kChunkHeader) {
    throw InputError(name, "truncated: the chunk at byte " + std::to_string(offset) + " needs " +
                               std::to_string(length) + " bytes; copy or export the file again");
  }
  return file.subspan(offset + kChunkHeader, length);
}

Container SplitGlb(std::span<const std::byte> file, const std::string& name) {
  if (file.size() < kGlbHeader + kChunkHeader) {
    throw InputError(name, "truncated: too short for a GLB file; copy or export it again");
  }
  const uint32_t version = ReadWord(file, 4);
  if (version != 2) {
    throw InputError(
        name, "GLB version " + std::to_string(version) + " is not supported; export as glTF 2.0");
  }
  const uint64_t length = ReadWord(file, 8);
  if (length > file.size()) {
    throw InputError(name, "truncated: the header says " + std::to_string(length) +
                               " bytes, the file has " + std::to_string(file.size()) +
                               "; copy or export it again");
  }
  // A file longer than its header says carries something after the scene, which is not ours to
  // read.
  file = file.first(length);
  if (length < kGlbHeader + kChunkHeader || ReadWord(file, kGlbHeader + 4) != kJsonChunk) {
    throw InputError(name, "the first GLB chunk is not JSON; export the file again");
  }
  Container container;
  const std::span<const std::byte> json = ReadChunk(file, kGlbHeader, name);
  container.json = AsText(json);
  const uint64_t next = kGlbHeader + kChunkHeader + json.size();
  if (file.size() - next >= kChunkHeader && ReadWord(file, next + 4) == kBinChunk) {
    container.binary = ReadChunk(file, next, name);
  }
  return container;
}

}  // namespace

Container SplitContainer(std::span<const std::byte> file, const std::string& name) {
  if (file.empty()) throw InputError(name, "the file is empty; copy or export it again");
  if (file.size() >= 4 && ReadWord(file, 0) == kGlbMagic) return SplitGlb(file, name);
  std::string_view text = AsText(file);
  if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);
  const size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos || text[first] != '{') {
    throw InputError(name,
                     "not a glTF file: it starts neither with 'glTF' (GLB) nor with '{' (JSON); "
                     "name a .gltf or .glb file");
  }
  return {text.substr(first), std::nullopt};
}

void CheckNesting(std::string_view json, const std::string& name) {
  int depth = 0;
  bool in_string = false;
  for (size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_string) {
      if (c == '\\') ++i;
      in_string = c != '"';
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kDeepest) {
        throw InputError(name, "JSON is nested deeper than " + std::to_string(kDeepest) +
                                   " levels; remove the deep 'extras' or 'extensions'");
      }
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
}

}  // namespace carpool::render::gltf
