// See png_write.h. Uses libpng's simplified interface, which needs no longjmp.
#include "render/image/png_write.h"

#include <png.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "render/base/error.h"
#include "render/image/atomic_file.h"

namespace carpool::render {

void WritePng(const std::filesystem::path& path, int width, int height,
              std::span<const uint8_t> rgb) {
  if (width < 1 || height < 1 ||
      rgb.size() != 3 * static_cast<size_t>(width) * static_cast<size_t>(height)) {
    throw std::invalid_argument("WritePng: rgb does not have 3 x width x height bytes");
  }
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  std::vector<std::byte> bytes(PNG_IMAGE_PNG_SIZE_MAX(image));
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, rgb.data(), 0, nullptr) == 0) {
    throw OutputError(path.string(), std::string("cannot be written as PNG: ") + image.message);
  }
  bytes.resize(size);
  WriteFileAtomically(path, bytes);
}

}  // namespace carpool::render
