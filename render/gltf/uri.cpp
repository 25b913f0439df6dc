// URIs: decoding of data: and %XX, and the rule that a scene reads only from its own folder.
#include "render/gltf/uri.h"

#include <array>
#include <cctype>
#include <cstdint>
#include <system_error>

#include "render/base/error.h"

namespace carpool::render::gltf {
namespace {

namespace fs = std::filesystem;

constexpr int kNotBase64 = -1;

int HexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

constexpr std::array<int8_t, 256> MakeBase64Table() {
  std::array<int8_t, 256> table{};
  for (int8_t& entry : table) entry = kNotBase64;
  for (int i = 0; i < 26; ++i) {
    table['A' + i] = static_cast<int8_t>(i);
    table['a' + i] = static_cast<int8_t>(26 + i);
  }
  for (int i = 0; i < 10; ++i) table['0' + i] = static_cast<int8_t>(52 + i);
  table['+'] = table['-'] = 62;  // also the URL-safe alphabet
  table['/'] = table['_'] = 63;
  return table;
}

std::vector<std::byte> DecodeBase64(std::string_view text, const std::string& where) {
  static constexpr std::array<int8_t, 256> kTable = MakeBase64Table();
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  std::vector<std::byte> out;
  out.reserve(text.size() / 4 * 3 + 3);
  uint32_t bits = 0;
  int count = 0;
  for (char c : text) {
    const int value = kTable[static_cast<unsigned char>(c)];
    if (value == kNotBase64)
      throw InputError(where, "the data: URI is not valid base64; export the file again");
    bits = bits << 6 | static_cast<uint32_t>(value);
    if (++count == 4) {
      for (int shift = 16; shift >= 0; shift -= 8)
        out.push_back(static_cast<std::byte>(bits >> shift));
      bits = 0;
      count = 0;
    }
  }
  if (count == 1)
    throw InputError(where, "the data: URI's base64 is cut off; export the file again");
  if (count == 2) out.push_back(static_cast<std::byte>(bits >> 4));
  if (count == 3) {
    out.push_back(static_cast<std::byte>(bits >> 10));
    out.push_back(static_cast<std::byte>(bits >> 2));
  }
  return out;
}

/// True for "name:..." with a scheme of two or more letters before any slash.
bool HasScheme(std::string_view uri) {
  const size_t colon = uri.find(':');
  if (colon == std::string_view::npos || colon < 2 || uri.find('/') < colon) return false;
  for (char c : uri.substr(0, colon)) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '+' && c != '-' && c != '.')
      return false;
  }
  return std::isalpha(static_cast<unsigned char>(uri[0])) != 0;
}

bool Contains(const fs::path& folder, const fs::path& file) {
  const fs::path relative = file.lexically_relative(folder);
  return !relative.empty() && *relative.begin() != "..";
}

bool Exists(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

[[noreturn]] void RefuseOutside(std::string_view uri, const std::string& where) {
  throw InputError(where,
                   "URI " + Quoted(uri) +
                       " leaves the scene's folder; "
                       "move the file there, or pass --allow-outside if you trust the scene");
}

}  // namespace

std::string Quoted(std::string_view text) {
  constexpr size_t kLongest = 120;
  std::string out = "'";
  for (char c : text.substr(0, kLongest))
    out += std::iscntrl(static_cast<unsigned char>(c)) ? '?' : c;
  return out + (text.size() > kLongest ? "...'" : "'");
}

bool IsDataUri(std::string_view uri) {
  return uri.substr(0, 5) == "data:";
}

std::vector<std::byte> DecodeDataUri(std::string_view uri, const std::string& where,
                                     ByteBudget& budget) {
  const size_t comma = uri.find(',');
  if (comma == std::string_view::npos) {
    throw InputError(where, "the data: URI has no ','; export the file again");
  }
  const std::string_view head = uri.substr(0, comma), payload = uri.substr(comma + 1);
  constexpr std::string_view kBase64 = ";base64";
  const bool base64 =
      head.size() >= kBase64.size() && head.substr(head.size() - kBase64.size()) == kBase64;
  budget.Take(base64 ? payload.size() / 4 * 3 : payload.size(), where);
  if (base64) {
    // Escapes inside base64 are rare ("%3D"), so the common case does not copy.
    if (payload.find('%') == std::string_view::npos) return DecodeBase64(payload, where);
    return DecodeBase64(PercentDecode(payload), where);
  }
  const std::string text = PercentDecode(payload);
  const auto* begin = reinterpret_cast<const std::byte*>(text.data());
  return {begin, begin + text.size()};
}

std::string PercentDecode(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (size_t i = 0; i < text.size(); ++i) {
    const int high = text[i] == '%' && i + 2 < text.size() ? HexDigit(text[i + 1]) : -1;
    const int low = high >= 0 ? HexDigit(text[i + 2]) : -1;
    if (low < 0) {
      out += text[i];
      continue;
    }
    out += static_cast<char>(high * 16 + low);
    i += 2;
  }
  return out;
}

fs::path ResolveUri(const fs::path& folder, std::string_view uri, bool allow_outside,
                    const std::string& where) {
  if (HasScheme(uri)) {
    throw InputError(where, "URI " + Quoted(uri) +
                                " has a scheme that is not supported; "
                                "use a file name relative to the scene, or data:");
  }
  fs::path name = PercentDecode(uri);
  if (!Exists(folder / name) && Exists(folder / fs::path(std::string(uri)))) {
    name = std::string(uri);  // a file whose real name contains a per cent sign
  }
  if (name.empty() || name.native().find('\0') != std::string::npos) {
    throw InputError(where, "URI " + Quoted(uri) + " names no file; correct it");
  }
  const fs::path path = folder / name;
  if (allow_outside) return path;
  // First as written: `..` past the folder is refused even where it would come back.
  if (name.is_absolute() || *name.lexically_normal().begin() == "..") RefuseOutside(uri, where);
  std::error_code error;
  const fs::path real_folder = fs::canonical(folder, error);
  const fs::path real_path = error ? path : fs::weakly_canonical(path, error);
  if (error)
    throw InputError(where, "URI " + Quoted(uri) + " cannot be resolved (" + error.message() +
                                "); check the file");
  if (!Contains(real_folder, real_path)) RefuseOutside(uri, where);
  return real_path;
}

}  // namespace carpool::render::gltf
