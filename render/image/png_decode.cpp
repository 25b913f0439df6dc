// PNG into RGBA texels through libpng.
//
// libpng reports errors by longjmp, which must not pass over destructors: every function that
// libpng may leave that way (those called between setjmp and the end of Guarded) has trivial locals
// only.
#include <png.h>

#include <array>
#include <csetjmp>
#include <cstring>
#include <vector>

#include "render/image/image_codecs.h"

namespace carpool::render {
namespace {

/// A reader over a block of memory, with libpng's structures and its last message.
class PngReader {
 public:
  PngReader(std::span<const std::byte> bytes, const std::string& where)
      : bytes_(bytes), where_(where) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, &OnError, &OnWarning);
    info_ = png_ == nullptr ? nullptr : png_create_info_struct(png_);
    if (info_ == nullptr) {
      png_destroy_read_struct(&png_, nullptr, nullptr);
      throw std::bad_alloc();
    }
  }
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  /// Reads up to the first pixel data.
  ImageInfo ReadInfo() {
    if (!Guarded(&ReadInfoUnguarded)) Fail();
    const int64_t width = png_get_image_width(png_, info_);
    const int64_t height = png_get_image_height(png_, info_);
    CheckImageSize(width, height, where_);
    CheckPlausible(height);
    const bool wide = png_get_bit_depth(png_, info_) == 16;
    return {static_cast<int>(width), static_cast<int>(height),
            wide ? stages::TexelFormat::rgba16 : stages::TexelFormat::rgba8};
  }

  /// Reads all rows, to be called after ReadInfo; `rows` has one pointer per row.
  void ReadRows(std::vector<png_bytep>& rows, size_t row_bytes) {
    rows_ = rows.data();
    row_bytes_ = row_bytes;
    if (!Guarded(&ReadRowsUnguarded)) Fail();
  }

 private:
  static PngReader& Self(png_voidp pointer) { return *static_cast<PngReader*>(pointer); }

  static void OnError(png_structp png, png_const_charp message) {
    PngReader& self = Self(png_get_error_ptr(png));
    std::strncpy(self.message_.data(), message, self.message_.size() - 1);
    std::longjmp(self.escape_, 1);
  }
  // Warnings concern ancillary chunks (colour profiles and the like), which are ignored anyway.
  static void OnWarning(png_structp, png_const_charp) {}

  static void OnRead(png_structp png, png_bytep out, size_t count) {
    PngReader& self = Self(png_get_io_ptr(png));
    if (count > self.bytes_.size() - self.position_) png_error(png, "the file ends too early");
    std::memcpy(out, self.bytes_.data() + self.position_, count);
    self.position_ += count;
  }

  /// Runs `step`; false if libpng reported an error.
  bool Guarded(void (*step)(PngReader&)) {
    if (setjmp(escape_) != 0) return false;
    step(*this);
    return true;
  }

  static void ReadInfoUnguarded(PngReader& self) {
    png_set_read_fn(self.png_, &self, &OnRead);
    png_set_user_limits(self.png_, kMaxImageDimension, kMaxImageDimension);
    png_read_info(self.png_, self.info_);
  }

  static void ReadRowsUnguarded(PngReader& self) {
    png_structp png = self.png_;
    png_set_expand(png);  // palette to RGB, 1-4 bits to 8, tRNS to alpha
    png_set_gray_to_rgb(png);
    png_set_add_alpha(png, 0xffff, PNG_FILLER_AFTER);  // opaque where there is none
    png_set_swap(png);                                 // 16 bits: little-endian
    png_set_interlace_handling(png);
    png_read_update_info(png, self.info_);
    if (png_get_rowbytes(png, self.info_) != self.row_bytes_) png_error(png, "unexpected row size");
    png_read_image(png, self.rows_);
    png_read_end(png, nullptr);
  }

  /// Deflate cannot do better than 1032 to 1, so a small file that claims many pixels is broken.
  void CheckPlausible(int64_t height) const {
    const auto row_bytes = static_cast<int64_t>(png_get_rowbytes(png_, info_));
    if (row_bytes * height > 1040 * static_cast<int64_t>(bytes_.size())) {
      throw InputError(where_, "bad PNG: the header claims more pixels than the file can hold");
    }
  }

  [[noreturn]] void Fail() const {
    throw InputError(where_, "bad PNG: " + std::string(message_.data()));
  }

  std::span<const std::byte> bytes_;
  size_t position_ = 0;
  const std::string& where_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  png_bytepp rows_ = nullptr;
  size_t row_bytes_ = 0;
  std::jmp_buf escape_;
  std::array<char, 200> message_{};
};

}  // namespace

ImageInfo ReadPngInfo(std::span<const std::byte> bytes, const std::string& where) {
  return PngReader(bytes, where).ReadInfo();
}

void DecodePng(std::span<const std::byte> bytes, const std::string& where, const ImageInfo& info,
               std::span<uint32_t> words) {
  PngReader reader(bytes, where);
  reader.ReadInfo();
  const size_t row_words = words.size() / static_cast<size_t>(info.height);
  std::vector<png_bytep> rows(static_cast<size_t>(info.height));
  for (size_t y = 0; y < rows.size(); ++y) {
    rows[y] = reinterpret_cast<png_bytep>(words.data() + y * row_words);
  }
  reader.ReadRows(rows, row_words * sizeof(uint32_t));
}

}  // namespace carpool::render
