// Text made safe to stand in a page.
#pragma once

#include <string>

namespace carpool::render {

/// `&` and `<` as entities; for text between tags, not for attributes.
inline std::string Escape(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else {
      out += c;
    }
  }
  return out;
}

}  // namespace carpool::render
