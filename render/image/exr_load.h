// Opens EXR files of unknown origin under limits on what they may make us allocate. Internal to
// render/image.
#pragma once

#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>

#include <cstddef>
#include <functional>
#include <span>
#include <string>

namespace carpool::render {

/// Width and height of the data window, which may begin anywhere.
struct ExrSize {
  int width = 0;
  int height = 0;
  size_t Pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
};

/// Checks the header, opens the file and calls `use(file, size)`. Sizes over the limits of
/// image_decode.h, headers that claim more than the bytes could hold and whatever OpenEXR throws
/// become InputErrors.
void WithExrFile(std::span<const std::byte> bytes, const std::string& where,
                 const std::function<void(Imf::InputFile&, ExrSize)>& use);

/// Lets OpenEXR write channel values to `plane`, whose first element is the data window's first
/// pixel; `stride` is the distance of neighbours in bytes.
Imf::Slice MakeReadSlice(Imf::PixelType type, const Imf::Header& header, void* plane,
                         size_t stride);

}  // namespace carpool::render
