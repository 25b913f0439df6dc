// Writing hard cases as files, and rendering them over independent seeds.
#include "tests/hard_cases/scene_case.h"

#include "render/image/exr_write.h"
#include "tests/render/session/render_once.h"

namespace carpool::test {
namespace {

void WriteSky(const std::filesystem::path& path, const Sky& sky) {
  std::vector<float> planes[3];
  for (size_t i = 0; i < sky.rgb.size(); ++i) planes[i % 3].push_back(sky.rgb[i]);
  const std::vector<render::ExrChannelView> channels = {{"R", std::span<const float>(planes[0])},
                                                        {"G", std::span<const float>(planes[1])},
                                                        {"B", std::span<const float>(planes[2])}};
  render::WriteExr(path, sky.width, sky.height, channels, {});
}

}  // namespace

Sky UniformSky(float radiance) {
  return {1, 1, {radiance, radiance, radiance}};
}

render::RenderSettings HardSettings(int samples, int depth) {
  render::RenderSettings s;
  s.width = s.height = 16;
  s.samples = samples;
  s.max_depth = depth;
  s.threads = 2;
  return s;
}

render::RenderSettings WriteCase(const SceneCase& scene, const std::filesystem::path& folder) {
  render::RenderSettings s = scene.settings;
  s.scene_path = scene.scene.Write(folder, scene.name).string();
  if (scene.sky.width > 0) {
    s.env_path = (folder / (scene.name + ".exr")).string();
    WriteSky(s.env_path, scene.sky);
  }
  return s;
}

std::string RenderCommand(const SceneCase& scene, uint64_t seed) {
  const render::RenderSettings& s = scene.settings;
  const render::RenderSettings usual;
  std::string line = "hard-cases --write cases && carpool render cases/" + scene.name + ".gltf";
  if (scene.sky.width > 0) line += " --env cases/" + scene.name + ".exr";
  line += " -o " + scene.name + "-image.exr --size " + std::to_string(s.width) + "x" +
          std::to_string(s.height) + " --samples " + std::to_string(s.samples) + " --depth " +
          std::to_string(s.max_depth) + " --seed " + std::to_string(seed);
  if (s.direct != usual.direct) line += " --direct " + std::string(render::Name(s.direct));
  if (s.roulette_depth != usual.roulette_depth)
    line += " --roulette " + std::to_string(s.roulette_depth);
  if (!s.robust) line += " --no-robust";
  return line;
}

Mean CaseRenderer::Seeds(uint32_t first, int count) const {
  Mean mean;
  render::RenderSettings settings = settings_;
  for (int i = 0; i < count; ++i) {
    settings.seed = first + static_cast<uint32_t>(i);
    mean.Add(MeanOf(RenderOnce(settings).image, "G"));
  }
  return mean;
}

}  // namespace carpool::test
