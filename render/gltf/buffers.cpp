// The bytes behind a scene: buffers, buffer views and encoded images.
#include <optional>
#include <span>

#include "render/gltf/document.h"
#include "render/gltf/uri.h"

namespace carpool::render::gltf {
namespace {

std::vector<std::byte> LoadUri(Document& document, const std::string& uri, const std::string& where,
                               uint64_t at_most) {
  if (IsDataUri(uri)) return DecodeDataUri(uri, where, document.budget);
  const std::filesystem::path path =
      ResolveUri(document.folder, uri, document.options.allow_outside, where);
  return ReadFile(path, where, document.budget, at_most);
}

Buffer LoadBuffer(Document& document, int index, std::optional<std::span<const std::byte>> binary) {
  const Json& json = document.Items("buffers")[index];
  const uint64_t length = json["byteLength"];
  const std::string pointer = Pointer("buffers", index);
  Buffer buffer;
  if (json.contains("uri")) {
    buffer.owned = LoadUri(document, json["uri"], document.Where(pointer + "/uri"), length);
    buffer.bytes = buffer.owned;
  } else if (index == 0 && binary) {
    buffer.bytes = *binary;
  } else {
    return buffer;
  }
  if (buffer.bytes.size() < length) {
    document.Fail(pointer + "/byteLength", "the buffer has " + std::to_string(buffer.bytes.size()) +
                                               " of its " + std::to_string(length) +
                                               " bytes; copy or export the file again");
  }
  buffer.bytes = buffer.bytes.first(length);
  buffer.present = true;
  return buffer;
}

EncodedImage LoadImage(Document& document, int index, bool used) {
  const Json& json = document.Items("images")[index];
  const std::string pointer = Pointer("images", index);
  const bool has_uri = json.contains("uri");
  const std::string uri = has_uri ? json["uri"].get<std::string>() : std::string();
  std::string label = Get<std::string>(json, "name", "");
  if (has_uri && !IsDataUri(uri)) label = PercentDecode(uri);
  EncodedImage image;
  image.where = document.Where(pointer) + (label.empty() ? "" : " (" + label + ")");
  for (char& c : image.where) c = static_cast<unsigned char>(c) < ' ' ? '?' : c;
  if (!used) return image;
  if (has_uri) {
    image.bytes = LoadUri(document, uri, document.Where(pointer + "/uri"), document.budget.left);
  } else if (json.contains("bufferView")) {
    const std::span<const std::byte> bytes = BufferViewBytes(document, json["bufferView"]);
    document.budget.Take(bytes.size(), image.where);
    image.bytes.assign(bytes.begin(), bytes.end());
  } else {
    document.Fail(pointer, "the image has neither uri nor bufferView; give it one");
  }
  if (image.bytes.empty()) document.Fail(pointer, "the image is empty; export the file again");
  return image;
}

}  // namespace

void LoadBuffers(Document& document, std::optional<std::span<const std::byte>> binary) {
  const int count = static_cast<int>(document.Items("buffers").size());
  document.buffers.reserve(count);
  for (int i = 0; i < count; ++i) document.buffers.push_back(LoadBuffer(document, i, binary));
}

std::span<const std::byte> BufferViewBytes(const Document& document, int view) {
  const Json& json = document.Items("bufferViews")[view];
  const int index = json["buffer"];
  const Buffer& buffer = document.buffers[index];
  if (!buffer.present) {
    document.Fail(Pointer("buffers", index), "the buffer has no data; give it a uri");
  }
  // The schema keeps both below 2^53, so that their sum fits.
  const uint64_t offset = Get<uint64_t>(json, "byteOffset", 0);
  const uint64_t length = json["byteLength"];
  if (offset + length > buffer.bytes.size()) {
    document.Fail(Pointer("bufferViews", view),
                  "bytes [" + std::to_string(offset) + ", " + std::to_string(offset + length) +
                      ") lie outside the buffer's " + std::to_string(buffer.bytes.size()) +
                      "; export the file again");
  }
  return buffer.bytes.subspan(offset, length);
}

std::vector<EncodedImage> LoadImages(Document& document, const std::vector<bool>& used) {
  std::vector<EncodedImage> images;
  images.reserve(used.size());
  for (size_t i = 0; i < used.size(); ++i)
    images.push_back(LoadImage(document, static_cast<int>(i), used[i]));
  return images;
}

}  // namespace carpool::render::gltf
