// Radiance .hdr pictures: header, orientation and the three pixel encodings (flat, old and new
// RLE).
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <sstream>
#include <string_view>

#include "render/base/error.h"
#include "render/image/environment_codecs.h"

namespace carpool::render {
namespace {

using Rgbe = std::array<uint8_t, 4>;

/// Takes bytes and lines off the front of the file; running out is an InputError.
class Reader {
 public:
  Reader(std::span<const std::byte> bytes, const std::string& where)
      : bytes_(bytes), where_(where) {}

  [[noreturn]] void Fail(const std::string& what) const {
    throw InputError(where_, "bad Radiance file: " + what);
  }
  uint8_t Byte() {
    if (bytes_.empty()) Fail("the file ends too early");
    const auto value = static_cast<uint8_t>(bytes_.front());
    bytes_ = bytes_.subspan(1);
    return value;
  }
  Rgbe Pixel() {
    Rgbe pixel;
    for (uint8_t& byte : pixel) byte = Byte();
    return pixel;
  }
  std::string Line() {
    constexpr size_t kLongest = 4096;
    std::string line;
    for (char c; (c = static_cast<char>(Byte())) != '\n';) {
      if (line.size() == kLongest) Fail("a header line is too long");
      line += c;
    }
    if (!line.empty() && line.back() == '\r') line.pop_back();
    return line;
  }

 private:
  std::span<const std::byte> bytes_;
  const std::string& where_;
};

struct Header {
  double exposure = 1;  // the product of all EXPOSURE lines
  Primaries primaries;
};

std::optional<std::string_view> ValueOf(std::string_view line, std::string_view key) {
  if (!line.starts_with(key) || line.size() <= key.size() || line[key.size()] != '=') return {};
  return line.substr(key.size() + 1);
}

/// Reads as many numbers as `out` has, in any locale; false if there are fewer.
bool ParseNumbers(std::string_view text, std::span<double> out) {
  std::istringstream stream{std::string(text)};
  stream.imbue(std::locale::classic());
  return std::ranges::all_of(out, [&](double& number) { return bool(stream >> number); });
}

Header ReadHeader(Reader& reader) {
  Header header;
  for (std::string line; !(line = reader.Line()).empty();) {
    std::array<double, 1> exposure;
    std::array<double, 8> p;
    if (const auto format = ValueOf(line, "FORMAT"); format && *format != "32-bit_rle_rgbe") {
      reader.Fail("the pixels are '" + std::string(*format) + "'; convert them to 32-bit_rle_rgbe");
    } else if (const auto value = ValueOf(line, "EXPOSURE"); value) {
      const bool valid = ParseNumbers(*value, exposure) && exposure[0] > 0;
      header.exposure *= valid ? exposure[0] : 0;
      if (!(header.exposure > 1e-30 && header.exposure < 1e30)) reader.Fail("EXPOSURE is not sane");
    } else if (const auto xy = ValueOf(line, "PRIMARIES"); xy) {
      if (!ParseNumbers(*xy, p)) reader.Fail("PRIMARIES needs eight numbers");
      const bool known = std::ranges::any_of(p, [](double number) { return number != 0; });
      if (known) header.primaries = {{p[0], p[1]}, {p[2], p[3]}, {p[4], p[5]}, {p[6], p[7]}};
    }
  }
  return header;
}

/// "-Y height +X width": the axis named first changes per scan line, the other within it.
struct Resolution {
  bool rows_first = true;   // scan lines are rows
  bool flip_lines = false;  // the first scan line is the bottom row or right column
  bool flip_along = false;  // a scan line runs to the left or up
  int64_t lines = 0;
  int64_t length = 0;
};

Resolution ParseResolution(const Reader& reader, const std::string& line) {
  std::istringstream stream(line);
  std::string first, second;
  Resolution r;
  if (!(stream >> first >> r.lines >> second >> r.length) || first.size() != 2 ||
      second.size() != 2) {
    reader.Fail("the resolution line is '" + line + "'");
  }
  const auto is_axis = [](const std::string& axis, char name) {
    return axis[1] == name && (axis[0] == '+' || axis[0] == '-');
  };
  r.rows_first = first[1] == 'Y';
  if (!is_axis(first, r.rows_first ? 'Y' : 'X') || !is_axis(second, r.rows_first ? 'X' : 'Y')) {
    reader.Fail("the resolution line is '" + line + "'");
  }
  // Standard is -Y (downwards) and +X (to the right).
  r.flip_lines = first[0] != (r.rows_first ? '-' : '+');
  r.flip_along = second[0] != (r.rows_first ? '+' : '-');
  return r;
}

/// New encoding: each of the four channels in runs of its own.
void ReadPlanarLine(Reader& reader, std::span<Rgbe> line) {
  for (size_t channel = 0; channel < 4; ++channel) {
    for (size_t x = 0; x < line.size();) {
      const uint8_t code = reader.Byte();
      const bool run = code > 128;
      const size_t count = run ? code - 128u : code;
      if (count == 0 || count > line.size() - x) reader.Fail("a run leaves its scan line");
      uint8_t value = run ? reader.Byte() : uint8_t{0};
      for (size_t i = 0; i < count; ++i) {
        if (!run) value = reader.Byte();
        line[x++][channel] = value;
      }
    }
  }
}

/// Old encoding: plain pixels, among which (1, 1, 1, n) repeats the one before; several such in a
/// row give the digits of n in base 256, lowest first.
void ReadOldLine(Reader& reader, Rgbe pixel, std::span<Rgbe> line) {
  unsigned shift = 0;
  for (size_t x = 0;;) {
    if (pixel[0] == 1 && pixel[1] == 1 && pixel[2] == 1) {
      const size_t count = shift < 24 ? size_t{pixel[3]} << shift : line.size() + 1;
      if (x == 0 || count > line.size() - x) reader.Fail("a run leaves its scan line");
      std::fill_n(line.begin() + static_cast<std::ptrdiff_t>(x), count, line[x - 1]);
      x += count;
      shift += 8;
    } else {
      line[x++] = pixel;
      shift = 0;
    }
    if (x == line.size()) return;
    pixel = reader.Pixel();
  }
}

void ReadLine(Reader& reader, std::span<Rgbe> line) {
  const Rgbe first = reader.Pixel();
  const bool planar =
      first[0] == 2 && first[1] == 2 && first[2] < 128 && line.size() >= 8 && line.size() < 32768;
  if (!planar) return ReadOldLine(reader, first, line);
  if (first[2] * size_t{256} + first[3] != line.size())
    reader.Fail("a scan line has the wrong length");
  ReadPlanarLine(reader, line);
}

/// Mantissas count from 0 as in all common readers; Radiance itself adds half a step.
void AppendLine(std::span<const Rgbe> line, double exposure, std::vector<float>& rgb) {
  for (const Rgbe& pixel : line) {
    const double scale = pixel[3] == 0 ? 0 : std::ldexp(1 / exposure, pixel[3] - 136);
    for (size_t i = 0; i < 3; ++i) rgb.push_back(static_cast<float>(pixel[i] * scale));
  }
}

/// Brings scan lines in file order into rows from the top.
std::vector<float> Orient(const Resolution& r, std::vector<float> lines) {
  if (r.rows_first && !r.flip_lines && !r.flip_along) return lines;
  const int64_t width = r.rows_first ? r.length : r.lines;
  std::vector<float> rows(lines.size());
  for (int64_t line = 0; line < r.lines; ++line) {
    for (int64_t at = 0; at < r.length; ++at) {
      const int64_t across = r.flip_lines ? r.lines - 1 - line : line;
      const int64_t along = r.flip_along ? r.length - 1 - at : at;
      const int64_t texel = r.rows_first ? across * width + along : along * width + across;
      std::copy_n(lines.begin() + 3 * (line * r.length + at), 3, rows.begin() + 3 * texel);
    }
  }
  return rows;
}

}  // namespace

RawEnvironment ReadRgbe(std::span<const std::byte> bytes, const std::string& where) {
  Reader reader(bytes, where);
  const Header header = ReadHeader(reader);
  const Resolution r = ParseResolution(reader, reader.Line());
  CheckEnvironmentSize(r.length, r.lines, where);
  RawEnvironment out;
  out.width = static_cast<int>(r.rows_first ? r.length : r.lines);
  out.height = static_cast<int>(r.rows_first ? r.lines : r.length);
  out.primaries = header.primaries;
  // Grows with what has been decoded, so that a short file cannot claim gigabytes.
  std::vector<float> lines;
  std::vector<Rgbe> line(static_cast<size_t>(r.length));
  for (int64_t i = 0; i < r.lines; ++i) {
    ReadLine(reader, line);
    AppendLine(line, header.exposure, lines);
  }
  out.rgb = Orient(r, std::move(lines));
  return out;
}

}  // namespace carpool::render
