// Writing JSON: strings, numbers, objects, lists.
#pragma once

#include <cstdint>
#include <cstdio>
#include <ostream>
#include <string>

namespace carpool {

inline std::string json_string(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      char code[8];
      std::snprintf(code, sizeof code, "\\u%04x", static_cast<unsigned>(c));
      result += code;
    } else {
      result += c;
    }
  }
  return result + '"';
}

// JsonObject writes the members of one object, with commas between them.
class JsonObject {
 public:
  explicit JsonObject(std::ostream& out) : out_(out) { out_ << '{'; }
  void text(const char* key, const std::string& value) { name(key) << json_string(value); }
  void number(const char* key, double value, const char* pattern = "%.9g") {
    char digits[64];
    std::snprintf(digits, sizeof digits, pattern, value);
    name(key) << digits;
  }
  void count(const char* key, std::uint64_t value) { name(key) << value; }
  std::ostream& name(const char* key) {
    out_ << (first_ ? "" : ",") << '"' << key << "\":";
    first_ = false;
    return out_;
  }
  void end() { out_ << '}'; }

 private:
  std::ostream& out_;
  bool first_ = true;
};

template <class Range, class Write>
void write_json_list(std::ostream& out, const Range& range, Write write) {
  out << '[';
  bool first = true;
  for (const auto& element : range) {
    out << (first ? "" : ",");
    first = false;
    write(element);
  }
  out << ']';
}

}  // namespace carpool
