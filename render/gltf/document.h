// A scene file as parsed: checked JSON, the bytes of its buffers, and where to complain.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "render/base/error.h"
#include "render/gltf/files.h"
#include "render/gltf/gltf.h"

namespace carpool::render::gltf {

using Json = nlohmann::json;

/// One buffer of the file; `bytes` lies in `owned` or in the file's BIN chunk. `present` is false
/// where the file gives it no data (only extensions that are not read could); touching such a
/// buffer is an error.
struct Buffer {
  std::vector<std::byte> owned;
  std::span<const std::byte> bytes;
  bool present = false;
};

/// Properties and assumptions: `json` has passed CheckSchema(), so core properties have the right
/// types, ranges and references, and the rest of the import reads them without asking again. Values
/// in `buffers` are unchecked. Not thread-safe.
struct Document {
  std::string name;              // the path as the user gave it, opens every message
  std::filesystem::path folder;  // URIs are relative to it
  LoadOptions options;           // with limits of 0 replaced
  ByteBudget budget;
  std::vector<std::byte> file;  // the scene file itself, kept for its BIN chunk
  Json json;
  std::vector<Buffer> buffers;
  std::set<std::string> warned;

  /// Items() is the array at a top-level `key`, empty where there is none.
  const Json& Items(const char* key) const;

  /// Warn() passes a warning on, unless one with the same `key` has been.
  void Warn(const std::string& key, const std::string& pointer, const std::string& what);

  /// Where() is what opens a message about the JSON at `pointer`.
  std::string Where(const std::string& pointer) const { return name + ": " + pointer; }

  [[noreturn]] void Fail(const std::string& pointer, const std::string& what) const {
    throw InputError(Where(pointer), what);
  }
};

/// OpenDocument() reads and checks the file, its extensions and its buffers.
Document OpenDocument(const std::filesystem::path& path, const LoadOptions& options);

/// LoadBuffers() fills `document.buffers`; `binary` is the GLB's BIN chunk, or empty.
void LoadBuffers(Document& document, std::optional<std::span<const std::byte>> binary);

/// BufferViewBytes() is the part of a buffer that a buffer view names, checked against its size.
std::span<const std::byte> BufferViewBytes(const Document& document, int view);

/// LoadImages() reads the encoded bytes of the images marked as used.
std::vector<EncodedImage> LoadImages(Document& document, const std::vector<bool>& used);

/// Property access on checked JSON: the value at `key`, or `otherwise`.
template <typename T>
T Get(const Json& object, const char* key, T otherwise) {
  const auto found = object.find(key);
  return found == object.end() ? otherwise : found->template get<T>();
}

/// The object at `key`, or an empty one.
const Json& Child(const Json& object, const char* key);

/// The object of an extension, or null where the object does not use it.
const Json* Extension(const Json& object, const char* name);

/// The N numbers at `key`, or `otherwise`.
template <size_t N>
std::array<double, N> Numbers(const Json& object, const char* key,
                              std::array<double, N> otherwise) {
  const auto found = object.find(key);
  if (found != object.end()) {
    for (size_t i = 0; i < N; ++i) otherwise[i] = (*found)[i].get<double>();
  }
  return otherwise;
}

/// "/a/3/b": Pointer("a", 3, "b").
template <typename... Parts>
std::string Pointer(const Parts&... parts) {
  std::string out;
  const auto append = [&out](const auto& part) {
    out += '/';
    if constexpr (std::is_arithmetic_v<std::decay_t<decltype(part)>>) {
      out += std::to_string(part);
    } else {
      out += part;
    }
  };
  (append(parts), ...);
  return out;
}

}  // namespace carpool::render::gltf
