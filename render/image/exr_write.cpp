// See exr_write.h. OpenEXR describes the header; the chunks are packed here, so that they compress
// in parallel on our own threads: OpenEXR's need a thread pool of their own, or else one thread
// does it all.
#include "render/image/exr_write.h"

#include <ImfChannelList.h>
#include <ImfChromaticitiesAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfHeader.h>
#include <ImfIntAttribute.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfVersion.h>
#include <ImfXdr.h>
#include <tbb/parallel_for.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <new>
#include <stdexcept>
#include <vector>

#include "render/posix/atomic_file.h"
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

/// A channel as the file stores it: 4 bytes a value, in machine order, which is the file's.
struct Plane {
  std::string name;
  Imf::PixelType type;
  std::span<const std::byte> bytes;
};
static_assert(std::endian::native == std::endian::little);

/// In the file's order, which is by name.
std::vector<Plane> CollectPlanes(std::span<const ExrChannelView> channels, size_t pixels) {
  std::vector<Plane> planes;
  for (const ExrChannelView& channel : channels) {
    const bool real = std::holds_alternative<std::span<const float>>(channel.plane);
    const auto bytes =
        std::visit([](const auto& plane) { return std::as_bytes(plane); }, channel.plane);
    if (bytes.size() != 4 * pixels) {
      throw std::invalid_argument("WriteExr: a plane does not have width x height values");
    }
    planes.push_back({channel.name, real ? Imf::FLOAT : Imf::UINT, bytes});
  }
  std::ranges::sort(planes, {}, &Plane::name);
  const auto same = std::ranges::adjacent_find(planes, {}, &Plane::name);
  if (same != planes.end() || planes.empty() || planes.front().name.empty()) {
    throw std::invalid_argument("WriteExr: channel names must be there and differ");
  }
  return planes;
}

/// Everything before the table of chunk offsets.
void WriteHeader(ExrMemoryOutput& out, const Imf::Header& header) {
  constexpr size_t kShortName = 31;
  bool long_names = false;
  for (auto it = header.begin(); it != header.end(); ++it) {
    long_names = long_names || std::strlen(it.name()) > kShortName;
  }
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
    long_names = long_names || std::strlen(it.name()) > kShortName;
  }
  header.sanityCheck();
  Imf::Xdr::write<Imf::StreamIO>(out, Imf::MAGIC);
  Imf::Xdr::write<Imf::StreamIO>(out, Imf::EXR_VERSION | (long_names ? Imf::LONG_NAMES_FLAG : 0));
  header.writeTo(out);
}

constexpr size_t kChunkLines = 16;  // of ZIP_COMPRESSION

/// The values of some lines as a chunk holds them: line by line, within it channel by channel.
std::vector<std::byte> PackLines(std::span<const Plane> planes, size_t width, size_t begin,
                                 size_t end) {
  std::vector<std::byte> packed;
  packed.reserve((end - begin) * planes.size() * 4 * width);
  for (size_t y = begin; y < end; ++y) {
    for (const Plane& plane : planes) {
      const auto line = plane.bytes.subspan(y * 4 * width, 4 * width);
      packed.insert(packed.end(), line.begin(), line.end());
    }
  }
  return packed;
}

/// OpenEXR's ZIP: even bytes before odd ones, differences of neighbours, deflate. Chunks that do
/// not shrink are stored as they are.
std::vector<std::byte> Compress(std::vector<std::byte> packed) {
  std::vector<uint8_t> split(packed.size());
  const size_t half = (packed.size() + 1) / 2;
  for (size_t i = 0; i < packed.size(); ++i) {
    split[i / 2 + (i % 2) * half] = static_cast<uint8_t>(packed[i]);
  }
  for (size_t i = split.size() - 1; i > 0; --i) {
    split[i] = static_cast<uint8_t>(split[i] - split[i - 1] + 128);
  }
  constexpr int kLevel = 4;  // OpenEXR's own choice
  std::vector<std::byte> deflated(compressBound(static_cast<uLong>(split.size())));
  uLongf size = static_cast<uLongf>(deflated.size());
  if (compress2(reinterpret_cast<Bytef*>(deflated.data()), &size, split.data(),
                static_cast<uLong>(split.size()), kLevel) != Z_OK) {
    throw std::bad_alloc();  // the only failure that compressBound leaves
  }
  if (size >= packed.size()) return packed;
  deflated.resize(size);
  return deflated;
}

/// The table of offsets, then each chunk behind its first line and its size.
void WriteChunks(ExrMemoryOutput& out, std::span<const std::vector<std::byte>> chunks) {
  uint64_t offset = out.tellp() + chunks.size() * sizeof(uint64_t);
  for (const auto& chunk : chunks) {
    Imf::Xdr::write<Imf::StreamIO>(out, offset);
    offset += 2 * sizeof(int) + chunk.size();
  }
  for (size_t i = 0; i < chunks.size(); ++i) {
    Imf::Xdr::write<Imf::StreamIO>(out, static_cast<int>(i * kChunkLines));
    Imf::Xdr::write<Imf::StreamIO>(out, static_cast<int>(chunks[i].size()));
    out.write(reinterpret_cast<const char*>(chunks[i].data()), static_cast<int>(chunks[i].size()));
  }
}

}  // namespace

void WriteExr(const std::filesystem::path& path, int width, int height,
              std::span<const ExrChannelView> channels, const ExrAttributes& attributes) {
  if (width < 1 || height < 1) throw std::invalid_argument("WriteExr: the image has no pixels");
  const auto columns = static_cast<size_t>(width), lines = static_cast<size_t>(height);
  const std::vector<Plane> planes = CollectPlanes(channels, columns * lines);
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::addChromaticities(header, Imf::Chromaticities());  // whose default is Rec.709
  InsertAttributes(header, attributes);
  for (const Plane& plane : planes) header.channels().insert(plane.name, Imf::Channel(plane.type));

  std::vector<std::vector<std::byte>> chunks((lines + kChunkLines - 1) / kChunkLines);
  tbb::parallel_for(size_t{0}, chunks.size(), [&](size_t i) {
    const size_t begin = i * kChunkLines, end = std::min(begin + kChunkLines, lines);
    chunks[i] = Compress(PackLines(planes, columns, begin, end));
  });
  ExrMemoryOutput file;
  WriteHeader(file, header);
  WriteChunks(file, chunks);
  WriteFileAtomically(path, file.Bytes());
}

}  // namespace carpool::render
