// PNG: chunks with their CRC around a zlib stream of stored blocks.
#include "scenes/png_writer.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace carpool::scenes {
namespace {

void AppendBigEndian(std::string& out, uint32_t word) {
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(word >> shift);
}

uint32_t Crc(std::string_view bytes) {
  uint32_t crc = 0xFFFFFFFFu;
  for (char c : bytes) {
    crc ^= static_cast<uint8_t>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0);
  }
  return ~crc;
}

uint32_t Adler(std::string_view bytes) {
  uint32_t a = 1, b = 0;
  for (char c : bytes) {
    a = (a + static_cast<uint8_t>(c)) % 65521;
    b = (b + a) % 65521;
  }
  return b << 16 | a;
}

void AppendChunk(std::string& out, const std::string& type, const std::string& data) {
  AppendBigEndian(out, static_cast<uint32_t>(data.size()));
  const std::string body = type + data;
  out += body;
  AppendBigEndian(out, Crc(body));
}

std::string StoreZlib(std::string_view bytes) {
  std::string out = "\x78\x01";
  for (size_t at = 0; at < bytes.size();) {
    const size_t length = std::min<size_t>(bytes.size() - at, 65535);
    out += at + length == bytes.size() ? '\1' : '\0';
    for (size_t word : {length, ~length}) {
      out += static_cast<char>(word);
      out += static_cast<char>(word >> 8);
    }
    out += bytes.substr(at, length);
    at += length;
  }
  AppendBigEndian(out, Adler(bytes));
  return out;
}

}  // namespace

std::string EncodePng(int width, int height, const std::vector<uint8_t>& rgb) {
  std::string rows;
  for (int y = 0; y < height; ++y) {
    rows += '\0';  // no row filter
    rows.append(reinterpret_cast<const char*>(&rgb[static_cast<size_t>(y) * width * 3]),
                static_cast<size_t>(width) * 3);
  }
  std::string header;
  AppendBigEndian(header, static_cast<uint32_t>(width));
  AppendBigEndian(header, static_cast<uint32_t>(height));
  header += std::string("\x08\x02\x00\x00\x00", 5);  // 8 bits, RGB
  std::string out = "\x89PNG\r\n\x1a\n";
  AppendChunk(out, "IHDR", header);
  AppendChunk(out, "IDAT", StoreZlib(rows));
  AppendChunk(out, "IEND", "");
  return out;
}

}  // namespace carpool::scenes
