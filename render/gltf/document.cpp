// Opening a scene file: container, JSON, schema, extensions, buffers, in this order.
#include "render/gltf/document.h"

#include "render/gltf/container.h"
#include "render/gltf/extensions.h"
#include "render/gltf/schema.h"

namespace carpool::render::gltf {
namespace {

Json ParseJson(std::string_view text, const std::string& name) {
  CheckNesting(text, name);
  // GLB pads its JSON chunk; blanks are the rule, zeros a common fault that costs nothing to
  // accept.
  while (!text.empty() && text.back() == '\0') text.remove_suffix(1);
  try {
    return Json::parse(text.begin(), text.end());
  } catch (const nlohmann::json::exception& error) {
    // The library's text has a prefix in brackets and may quote raw input over several lines.
    std::string line = error.what();
    for (char& c : line) c = static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    const size_t bracket = line.find("] ");
    if (bracket != std::string::npos) line.erase(0, bracket + 2);
    throw InputError(name, "invalid JSON: " + line + "; export the file again");
  }
}

/// True where `version` is "2.x".
bool IsVersion2(const std::string& version) {
  return version == "2" || version.substr(0, 2) == "2.";
}

void CheckVersion(const Document& document) {
  const Json& asset = document.json["asset"];
  const std::string version = asset["version"];
  const std::string least = Get<std::string>(asset, "minVersion", "2.0");
  if (!IsVersion2(version)) {
    document.Fail("/asset/version",
                  "glTF version '" + version + "' is not supported; export as glTF 2.0");
  }
  if (least != "2.0") {
    document.Fail("/asset/minVersion", "the file needs glTF '" + least + "'; export as glTF 2.0");
  }
}

}  // namespace

const Json& Document::Items(const char* key) const {
  static const Json kEmpty = Json::array();
  const auto found = json.find(key);
  return found == json.end() ? kEmpty : *found;
}

void Document::Warn(const std::string& key, const std::string& pointer, const std::string& what) {
  if (warned.insert(key).second && options.warn) options.warn(Where(pointer) + ": " + what);
}

Document OpenDocument(const std::filesystem::path& path, const LoadOptions& options) {
  Document document;
  document.name = path.string();
  document.folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  document.options = options;
  for (uint64_t* limit : {&document.options.max_file_bytes, &document.options.max_geometry_bytes}) {
    if (*limit == 0) *limit = HalfOfMemory();
  }
  document.budget.left = document.options.max_file_bytes;
  document.file = ReadFile(path, document.name, document.budget);
  const Container container = SplitContainer(document.file, document.name);
  document.json = ParseJson(container.json, document.name);
  CheckSchema(document);
  CheckVersion(document);
  CheckExtensions(document);
  LoadBuffers(document, container.binary);
  return document;
}

const Json& Child(const Json& object, const char* key) {
  static const Json kEmpty = Json::object();
  const auto found = object.find(key);
  return found == object.end() ? kEmpty : *found;
}

const Json* Extension(const Json& object, const char* name) {
  const auto extensions = object.find("extensions");
  if (extensions == object.end()) return nullptr;
  const auto found = extensions->find(name);
  return found == extensions->end() ? nullptr : &*found;
}

}  // namespace carpool::render::gltf
