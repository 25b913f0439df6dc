// The R, G, B or Y channels of an OpenEXR file as an environment map.
#include <ImfChannelList.h>
#include <ImfEnvmap.h>
#include <ImfFrameBuffer.h>
#include <ImfStandardAttributes.h>

#include <array>

#include "render/base/error.h"
#include "render/image/environment_codecs.h"
#include "render/image/exr_load.h"

namespace carpool::render {
namespace {

Primaries PrimariesOf(const Imf::Header& header) {
  if (!Imf::hasChromaticities(header)) return {};
  const Imf::Chromaticities& c = Imf::chromaticities(header);
  return {{c.red.x, c.red.y}, {c.green.x, c.green.y}, {c.blue.x, c.blue.y}, {c.white.x, c.white.y}};
}

/// Which channel feeds red, green and blue.
std::array<const char*, 3> ChooseChannels(const Imf::Header& header, const std::string& where) {
  const Imf::ChannelList& channels = header.channels();
  const auto has = [&](const char* name) { return channels.findChannel(name) != nullptr; };
  if (has("R") && has("G") && has("B")) return {"R", "G", "B"};
  if (has("Y") && !has("RY") && !has("BY")) return {"Y", "Y", "Y"};
  throw InputError(where, "the EXR has neither channels R, G, B nor Y alone");
}

}  // namespace

RawEnvironment ReadExrEnvironment(std::span<const std::byte> bytes, const std::string& where) {
  RawEnvironment out;
  WithExrFile(bytes, where, [&](Imf::InputFile& file, ExrSize size) {
    const Imf::Header& header = file.header();
    CheckEnvironmentSize(size.width, size.height, where);
    if (Imf::hasEnvmap(header) && Imf::envmap(header) != Imf::ENVMAP_LATLONG) {
      throw InputError(where, "the EXR is a cube map; convert it to lat-long with exrenvmap");
    }
    const std::array<const char*, 3> names = ChooseChannels(header, where);
    out.width = size.width;
    out.height = size.height;
    out.primaries = PrimariesOf(header);
    out.rgb.resize(3 * size.Pixels());
    constexpr size_t kStride = 3 * sizeof(float);
    const bool grey = names[0] == names[1];
    Imf::FrameBuffer frame;
    for (size_t i = 0; i < (grey ? 1 : 3); ++i) {
      frame.insert(names[i], MakeReadSlice(Imf::FLOAT, header, &out.rgb[i], kStride));
    }
    file.setFrameBuffer(frame);
    file.readPixels(header.dataWindow().min.y, header.dataWindow().max.y);
    for (size_t i = 0; grey && i < out.rgb.size(); i += 3)
      out.rgb[i + 1] = out.rgb[i + 2] = out.rgb[i];
  });
  return out;
}

}  // namespace carpool::render
