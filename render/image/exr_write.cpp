// See exr_write.h.
#include "render/image/exr_write.h"

#include <ImfChannelList.h>
#include <ImfChromaticitiesAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIntAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>

#include <stdexcept>

#include "render/base/error.h"
#include "render/image/atomic_file.h"
#include "render/image/exr_memory.h"
#include "render/image/exr_reserved.h"

namespace carpool::render {
namespace {

void InsertAttributes(Imf::Header& header, const ExrAttributes& attributes) {
  for (const auto& [name, value] : attributes) {
    if (name.empty() || name.size() > 255 || IsReservedExrAttribute(name)) {
      throw std::invalid_argument("WriteExr: attribute name '" + name + "' is not allowed");
    }
    if (const auto* text = std::get_if<std::string>(&value)) {
      header.insert(name, Imf::StringAttribute(*text));
    } else if (const auto* real = std::get_if<float>(&value)) {
      header.insert(name, Imf::FloatAttribute(*real));
    } else {
      header.insert(name, Imf::IntAttribute(std::get<int>(value)));
    }
  }
}

/// OpenEXR takes mutable pointers for output too, but only reads from them.
template <class T>
Imf::Slice MakeSlice(Imf::PixelType type, std::span<const T> plane, int width, int height) {
  if (plane.size() != static_cast<size_t>(width) * static_cast<size_t>(height)) {
    throw std::invalid_argument("WriteExr: a plane does not have width x height values");
  }
  auto* base = reinterpret_cast<char*>(const_cast<T*>(plane.data()));
  return Imf::Slice(type, base, sizeof(T), sizeof(T) * static_cast<size_t>(width));
}

void InsertChannel(Imf::Header& header, Imf::FrameBuffer& frame, const ExrChannelView& channel,
                   int width, int height) {
  if (channel.name.empty() || header.channels().findChannel(channel.name) != nullptr) {
    throw std::invalid_argument("WriteExr: channel name '" + channel.name + "' is empty or double");
  }
  const bool real = std::holds_alternative<std::span<const float>>(channel.plane);
  const Imf::PixelType type = real ? Imf::FLOAT : Imf::UINT;
  header.channels().insert(channel.name, Imf::Channel(type));
  frame.insert(channel.name,
               std::visit([&](const auto& plane) { return MakeSlice(type, plane, width, height); },
                          channel.plane));
}

}  // namespace

void WriteExr(const std::filesystem::path& path, int width, int height,
              std::span<const ExrChannelView> channels, const ExrAttributes& attributes) {
  if (width < 1 || height < 1) throw std::invalid_argument("WriteExr: the image has no pixels");
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::addChromaticities(header, Imf::Chromaticities());  // whose default is Rec.709
  InsertAttributes(header, attributes);
  Imf::FrameBuffer frame;
  for (const ExrChannelView& channel : channels) {
    InsertChannel(header, frame, channel, width, height);
  }
  // Through memory, because OpenEXR writes the offset table in a destructor, which cannot report
  // errors.
  ExrMemoryOutput memory;
  try {
    Imf::OutputFile file(memory, header, 0);
    file.setFrameBuffer(frame);
    file.writePixels(height);
  } catch (const IEX_NAMESPACE::BaseExc& error) {
    throw OutputError(path.string(), std::string("cannot be written: ") + error.what());
  }
  WriteFileAtomically(path, memory.Bytes());
}

}  // namespace carpool::render
