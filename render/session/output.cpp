// Files of a render: EXR layers under the names that denoisers and compositors expect, PNG, text.
#include "render/session/output.h"

#include <tbb/parallel_for.h>

#include "render/film/resolve.h"
#include "render/posix/atomic_file.h"
#include "render/image/exr_write.h"
#include "render/image/png_write.h"
#include "render/image/tonemap.h"
#include "render/session/ledger.h"
#include "render/session/version.h"

namespace carpool::render {
namespace {

using stages::FilmAccumulator;

/// Planes of an image until they are written.
class Layers {
 public:
  explicit Layers(size_t pixels) : pixels_(pixels) {}

  /// Interleaved triples become three channels.
  void AddTriple(const RgbPlane& triples, const std::array<const char*, 3>& names) {
    for (size_t c = 0; c < 3; ++c) {
      std::vector<float> plane(pixels_);
      for (size_t i = 0; i < pixels_; ++i) plane[i] = triples[3 * i + c];
      floats_.emplace_back(names[c], std::move(plane));
    }
  }
  template <class Value>
  void AddFloat(const char* name, Value value) {
    std::vector<float> plane(pixels_);
    for (size_t i = 0; i < pixels_; ++i) plane[i] = value(static_cast<uint32_t>(i));
    floats_.emplace_back(name, std::move(plane));
  }
  template <class Value>
  void AddId(const char* name, Value value) {
    std::vector<uint32_t> plane(pixels_);
    for (size_t i = 0; i < pixels_; ++i) plane[i] = value(static_cast<uint32_t>(i));
    ids_.emplace_back(name, std::move(plane));
  }

  std::vector<ExrChannelView> Views() const {
    std::vector<ExrChannelView> views;
    for (const auto& [name, plane] : floats_)
      views.push_back({name, std::span<const float>(plane)});
    for (const auto& [name, plane] : ids_)
      views.push_back({name, std::span<const uint32_t>(plane)});
    return views;
  }

 private:
  size_t pixels_;
  std::vector<std::pair<std::string, std::vector<float>>> floats_;
  std::vector<std::pair<std::string, std::vector<uint32_t>>> ids_;
};

template <class Read>
RgbPlane MeanPlane(const FilmAccumulator& film, Read read) {
  RgbPlane plane(size_t{film.width()} * film.height() * 3);
  for (uint32_t pixel = 0; pixel < film.width() * film.height(); ++pixel) {
    double value[3];
    read(pixel, value);
    for (int c = 0; c < 3; ++c) plane[size_t{pixel} * 3 + c] = static_cast<float>(value[c]);
  }
  return plane;
}

ExrAttributes Attributes(const RenderSummary& s) {
  return {{"carpool:version", std::string(kVersion)},
          {"carpool:scene", s.scene},
          {"carpool:camera", s.camera},
          {"carpool:environment", s.environment},
          {"carpool:samples", s.samples},
          {"carpool:seed", std::to_string(s.seed)},
          {"carpool:isa", s.isa},
          {"carpool:executor", s.executor},
          {"carpool:noise", static_cast<float>(s.noise)},
          {"carpool:sampleLedger", LedgerText(s)},
          {"carpool:seconds", static_cast<float>(s.render_seconds)},
          {"software", "Carpool " + std::string(kVersion)}};
}

}  // namespace

void WriteImage(const std::string& path, const FilmAccumulator& film, const Plan& plan,
                const RenderSummary& summary) {
  Layers layers(size_t{film.width()} * film.height());
  layers.AddTriple(ResolveBeauty(film), {"R", "G", "B"});
  if (plan.film.albedo) {
    layers.AddTriple(MeanPlane(film, [&](uint32_t p, double* v) { film.Albedo(p, v); }),
                     {"albedo.R", "albedo.G", "albedo.B"});
  }
  if (plan.film.normal) {
    layers.AddTriple(MeanPlane(film, [&](uint32_t p, double* v) { film.Normal(p, v); }),
                     {"normal.X", "normal.Y", "normal.Z"});
  }
  if (plan.standard_error) {
    layers.AddTriple(ResolveStandardError(film), {"stderr.R", "stderr.G", "stderr.B"});
  }
  if (plan.film.depth) layers.AddFloat("Z", [&](uint32_t p) { return film.Depth(p); });
  if (plan.sample_count) layers.AddId("count", [&](uint32_t p) { return film.Samples(p); });
  if (plan.film.object) layers.AddId("objectId", [&](uint32_t p) { return film.Object(p); });
  if (plan.film.material) layers.AddId("materialId", [&](uint32_t p) { return film.Material(p); });
  const std::vector<ExrChannelView> views = layers.Views();
  WriteExr(path, static_cast<int>(film.width()), static_cast<int>(film.height()), views,
           Attributes(summary));
}

void WritePicture(const std::string& path, const FilmAccumulator& film, float exposure_ev,
                  bool preview) {
  const RgbPlane beauty = preview ? ResolvePreview(film) : ResolveBeauty(film);
  std::vector<uint8_t> codes(beauty.size());
  const float scale = ExposureScale(exposure_ev);
  tbb::parallel_for(size_t{0}, beauty.size() / 3, [&](size_t i) {
    const auto rgb = Tonemap({beauty[3 * i], beauty[3 * i + 1], beauty[3 * i + 2]}, scale);
    std::copy(rgb.begin(), rgb.end(), codes.begin() + static_cast<ptrdiff_t>(3 * i));
  });
  WritePng(path, static_cast<int>(film.width()), static_cast<int>(film.height()), codes);
}

void WriteText(const std::string& path, const std::string& text) {
  WriteFileAtomically(path, std::as_bytes(std::span(text)));
}

}  // namespace carpool::render
