// See exr_load.h.
#include "render/image/exr_load.h"

#include <Iex.h>
#include <ImathBox.h>
#include <ImfChannelList.h>
#include <ImfVersion.h>
#include <ImfXdr.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <mutex>

#include "render/base/error.h"
#include "render/image/exr_memory.h"
#include "render/image/image_codecs.h"

namespace carpool::render {
namespace {

/// OpenEXR's own limits are global; they hold for the parts whose headers we do not look at.
void SetGlobalLimits() {
  static std::once_flag once;
  std::call_once(once, [] {
    Imf::Header::setMaxImageSize(kMaxImageDimension, kMaxImageDimension);
    Imf::Header::setMaxTileSize(4096, 4096);
  });
}

/// Takes the text up to the next zero byte off the front.
std::string TakeText(std::span<const std::byte>& rest) {
  const auto end = std::ranges::find(rest, std::byte{0});
  if (end == rest.end()) throw IEX_NAMESPACE::InputExc("the header ends too early");
  std::string text;
  for (auto it = rest.begin(); it != end; ++it) text += static_cast<char>(*it);
  rest = rest.subspan(text.size() + 1);
  return text;
}

/// Takes one header off the front: name, type, length and data of attributes up to an empty name.
void TakeHeader(std::span<const std::byte>& rest) {
  while (!TakeText(rest).empty()) {
    TakeText(rest);  // the type
    uint32_t length = 0;
    if (rest.size() < sizeof(length)) throw IEX_NAMESPACE::InputExc("the header ends too early");
    std::memcpy(&length, rest.data(), sizeof(length));
    rest = rest.subspan(sizeof(length));
    if (length > rest.size()) throw IEX_NAMESPACE::InputExc("an attribute is longer than the file");
    rest = rest.subspan(length);
  }
}

/// OpenEXR allocates what an attribute claims before it reads: checks that all claims are within
/// the file. Files of several parts have several headers, up to an empty one.
void CheckAttributeLengths(std::span<const std::byte> headers, bool several) {
  do {
    TakeHeader(headers);
  } while (several && !headers.empty() && headers.front() != std::byte{0});
}

/// The header of the first part, read ahead of Imf::InputFile, which allocates as it opens.
Imf::Header ReadFirstHeader(std::span<const std::byte> bytes) {
  ExrMemoryInput stream(bytes);
  int magic = 0, version = 0;
  Imf::Xdr::read<Imf::StreamIO>(stream, magic);
  Imf::Xdr::read<Imf::StreamIO>(stream, version);
  if (magic != Imf::MAGIC) throw IEX_NAMESPACE::InputExc("not an EXR file");
  if (Imf::isNonImage(version)) throw IEX_NAMESPACE::InputExc("deep images cannot be read");
  CheckAttributeLengths(bytes.subspan(stream.tellg()), Imf::isMultiPart(version));
  Imf::Header header;
  header.readFrom(stream, version);
  return header;
}

/// The largest factor by which the compression could have shrunk pixels.
int64_t LargestRatio(Imf::Compression compression) {
  switch (compression) {
    case Imf::NO_COMPRESSION:
      return 1;
    case Imf::RLE_COMPRESSION:
    case Imf::ZIPS_COMPRESSION:
    case Imf::ZIP_COMPRESSION:
    case Imf::PIZ_COMPRESSION:
    case Imf::PXR24_COMPRESSION:
    case Imf::B44_COMPRESSION:
    case Imf::B44A_COMPRESSION:
      return 2100;  // deflate reaches 1032; PXR24 drops a quarter first, PIZ packs runs about as
                    // tightly
    default:
      return 70000;  // DWA: blocks of 64 values to one, which deflate shrinks further
  }
}

ExrSize CheckedSize(const Imf::Header& header, size_t file_bytes, const std::string& where) {
  const Imath::Box2i window = header.dataWindow();
  const int64_t width = int64_t{window.max.x} - window.min.x + 1;
  const int64_t height = int64_t{window.max.y} - window.min.y + 1;
  CheckImageSize(width, height, where);
  int64_t pixel_bytes = 0;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
    pixel_bytes += it.channel().type == Imf::HALF ? 2 : 4;
    if (it.channel().xSampling != 1 || it.channel().ySampling != 1) {
      throw InputError(where, "EXR with subsampled channels; convert it to R, G and B");
    }
  }
  const int64_t most = LargestRatio(header.compression()) * static_cast<int64_t>(file_bytes);
  if (width * height * pixel_bytes > most) {
    throw InputError(where, "bad EXR: the header claims more pixels than the file can hold");
  }
  return {static_cast<int>(width), static_cast<int>(height)};
}

/// OpenEXR's messages may have several lines; ours have one.
std::string OneLine(std::string text) {
  std::ranges::replace(text, '\n', ' ');
  return text;
}

}  // namespace

void WithExrFile(std::span<const std::byte> bytes, const std::string& where,
                 const std::function<void(Imf::InputFile&, ExrSize)>& use) {
  SetGlobalLimits();
  try {
    const ExrSize size = CheckedSize(ReadFirstHeader(bytes), bytes.size(), where);
    ExrMemoryInput stream(bytes);
    Imf::InputFile file(stream, 0);
    use(file, size);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw InputError(where, "bad EXR: " + OneLine(error.what()));
  }
}

Imf::Slice MakeReadSlice(Imf::PixelType type, const Imf::Header& header, void* plane,
                         size_t stride) {
  const Imath::Box2i window = header.dataWindow();
  const auto width = static_cast<int64_t>(window.max.x) - window.min.x + 1;
  const auto height = static_cast<int64_t>(window.max.y) - window.min.y + 1;
  return Imf::Slice::Make(type, plane, window.min, width, height, stride,
                          stride * static_cast<size_t>(width));
}

}  // namespace carpool::render
