// See exr_read.h.
#include "render/image/exr_read.h"

#include <ImfChannelList.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfIntAttribute.h>
#include <ImfStringAttribute.h>

#include <algorithm>

#include "render/image/exr_load.h"
#include "render/image/exr_reserved.h"
#include "render/image/file_read.h"

namespace carpool::render {
namespace {

void CollectAttributes(const Imf::Header& header, ExrAttributes& out) {
  for (auto it = header.begin(); it != header.end(); ++it) {
    const std::string name = it.name();
    if (IsReservedExrAttribute(name)) continue;
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute())) {
      out[name] = text->value();
    } else if (const auto* real = dynamic_cast<const Imf::FloatAttribute*>(&it.attribute())) {
      out[name] = real->value();
    } else if (const auto* integer = dynamic_cast<const Imf::IntAttribute*>(&it.attribute())) {
      out[name] = integer->value();
    }
  }
}

template <class T>
void AddPlane(Imf::PixelType type, const Imf::Header& header, ExrSize size, ExrChannel& channel,
              Imf::FrameBuffer& frame) {
  auto& plane = channel.plane.emplace<std::vector<T>>(size.Pixels());
  frame.insert(channel.name, MakeReadSlice(type, header, plane.data(), sizeof(T)));
}

void ReadChannels(Imf::InputFile& file, ExrSize size, std::vector<ExrChannel>& out) {
  const Imf::Header& header = file.header();
  Imf::FrameBuffer frame;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
    ExrChannel& channel = out.emplace_back();
    channel.name = it.name();
    if (it.channel().type == Imf::UINT) {
      AddPlane<uint32_t>(Imf::UINT, header, size, channel, frame);
    } else {
      AddPlane<float>(Imf::FLOAT, header, size, channel, frame);
    }
  }
  file.setFrameBuffer(frame);
  file.readPixels(header.dataWindow().min.y, header.dataWindow().max.y);
}

template <class T>
const std::vector<T>* FindPlane(const std::vector<ExrChannel>& channels, const std::string& name) {
  const auto found = std::ranges::find(channels, name, &ExrChannel::name);
  return found == channels.end() ? nullptr : std::get_if<std::vector<T>>(&found->plane);
}

}  // namespace

const std::vector<float>* ExrImage::FindFloats(const std::string& name) const {
  return FindPlane<float>(channels, name);
}
const std::vector<uint32_t>* ExrImage::FindIds(const std::string& name) const {
  return FindPlane<uint32_t>(channels, name);
}

ExrImage ReadExr(const std::filesystem::path& path) {
  return DecodeExr(ReadWholeFile(path), path.string());
}

ExrImage DecodeExr(std::span<const std::byte> bytes, const std::string& where) {
  ExrImage image;
  WithExrFile(bytes, where, [&](Imf::InputFile& file, ExrSize size) {
    image.width = size.width;
    image.height = size.height;
    CollectAttributes(file.header(), image.attributes);
    ReadChannels(file, size, image.channels);
  });
  return image;
}

}  // namespace carpool::render
