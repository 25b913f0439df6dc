// See make_images.h.
#include "tests/render/image/make_images.h"

#include <png.h>
#include <stdlib.h>
#include <turbojpeg.h>

#include <cstring>
#include <fstream>
#include <stdexcept>

namespace carpool::render {
namespace {

void Append(png_structp png, png_bytep data, size_t count) {
  auto& out = *static_cast<Bytes*>(png_get_io_ptr(png));
  const auto* bytes = reinterpret_cast<const std::byte*>(data);
  out.insert(out.end(), bytes, bytes + count);
}
void Flush(png_structp) {}

}  // namespace

Bytes MakePng(const PngRecipe& recipe) {
  // The recipes of the tests are valid: an error here aborts through libpng's own handler.
  Bytes out;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(png, &out, &Append, &Flush);
  png_set_IHDR(png, info, static_cast<png_uint_32>(recipe.width),
               static_cast<png_uint_32>(recipe.height), recipe.bit_depth, recipe.color_type,
               recipe.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, 0, 0);
  std::vector<png_color> palette;
  for (size_t i = 0; i < recipe.palette.size(); i += 3) {
    palette.push_back({recipe.palette[i], recipe.palette[i + 1], recipe.palette[i + 2]});
  }
  if (!palette.empty()) png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
  if (!recipe.transparency.empty()) {
    png_set_tRNS(png, info, recipe.transparency.data(),
                 static_cast<int>(recipe.transparency.size()), nullptr);
  }
  if (recipe.transparent_grey >= 0) {
    png_color_16 key{};
    key.gray = static_cast<png_uint_16>(recipe.transparent_grey);
    png_set_tRNS(png, info, nullptr, 0, &key);
  }
  png_write_info(png, info);
  std::vector<png_bytep> rows;
  const size_t row_bytes = recipe.rows.size() / static_cast<size_t>(recipe.height);
  for (int y = 0; y < recipe.height; ++y) {
    rows.push_back(const_cast<png_bytep>(recipe.rows.data()) + static_cast<size_t>(y) * row_bytes);
  }
  png_write_image(png, rows.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return out;
}

Bytes MakeRgbaPng(int width, int height, std::span<const uint32_t> texels) {
  PngRecipe recipe{width, height, 8, PNG_COLOR_TYPE_RGBA};
  for (const uint32_t texel : texels) {
    for (int channel = 0; channel < 4; ++channel) {
      recipe.rows.push_back(static_cast<uint8_t>(texel >> (8 * channel)));
    }
  }
  return MakePng(recipe);
}

Bytes MakeJpeg(int width, int height, JpegKind kind, std::span<const uint8_t> color) {
  std::vector<uint8_t> pixels;
  for (int i = 0; i < width * height; ++i) pixels.insert(pixels.end(), color.begin(), color.end());
  const int format = kind == JpegKind::grey  ? TJPF_GRAY
                     : kind == JpegKind::rgb ? TJPF_RGB
                                             : TJPF_CMYK;
  tjhandle handle = tjInitCompress();
  unsigned char* data = nullptr;
  unsigned long size = 0;
  const int result =
      tjCompress2(handle, pixels.data(), width, 0, height, format, &data, &size,
                  kind == JpegKind::grey ? TJSAMP_GRAY : TJSAMP_444, 100, TJFLAG_ACCURATEDCT);
  const auto* bytes = reinterpret_cast<const std::byte*>(data);
  Bytes out = result == 0 ? Bytes(bytes, bytes + size) : Bytes();
  tjFree(data);
  tjDestroy(handle);
  if (out.empty()) throw std::runtime_error("MakeJpeg failed");
  return out;
}

Bytes ToBytes(const std::string& text) {
  const auto* bytes = reinterpret_cast<const std::byte*>(text.data());
  return Bytes(bytes, bytes + text.size());
}

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "carpool-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
  path_ = pattern;
}
TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

Bytes ReadBytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return ToBytes(std::string(std::istreambuf_iterator<char>(file), {}));
}
void WriteBytes(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  if (!file.flush()) throw std::runtime_error("test file not written");
}

}  // namespace carpool::render
