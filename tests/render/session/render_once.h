// Renders with given settings into a scratch folder and hands back the image.
#pragma once

#include "render/image/exr_read.h"
#include "render/session/session.h"
#include "tests/support/scene_builder.h"

namespace carpool::test {

/// The image of one render, and what the render said of itself.
struct Rendered {
  render::ExrImage image;
  render::RenderSummary summary;
};

inline Rendered RenderOnce(render::RenderSettings settings) {
  const ScratchFolder folder;
  settings.output_path = (folder.path() / "image.exr").string();
  settings.write_png = false;
  const std::atomic<bool> stop{false};
  Rendered rendered;
  rendered.summary = render::Render(settings, stop, {}, {});
  rendered.image = render::ReadExr(settings.output_path);
  return rendered;
}

/// Bytes of all channel samples: what has to be the same whatever drives the kernels.
inline std::string PixelBytes(const render::ExrImage& image) {
  std::string bytes;
  for (const render::ExrChannel& channel : image.channels) {
    bytes += channel.name + ":";
    std::visit(
        [&](const auto& plane) {
          bytes.append(reinterpret_cast<const char*>(plane.data()),
                       plane.size() * sizeof(plane[0]));
        },
        channel.plane);
  }
  return bytes;
}

/// Mean of a channel over the whole image.
inline double MeanOf(const render::ExrImage& image, const std::string& channel) {
  double sum = 0;
  const std::vector<float>& plane = *image.FindFloats(channel);
  for (const float value : plane) sum += value;
  return sum / static_cast<double>(plane.size());
}

}  // namespace carpool::test
