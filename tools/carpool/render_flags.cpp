// Declares the render flags to CLI11 and turns their words into settings.
#include "tools/carpool/render_flags.h"

#include <charconv>
#include <CLI/CLI.hpp>

#include "render/base/error.h"

namespace carpool::tools {

using render::RenderSettings;

namespace {

// Reads "1920x1080".
void ParseSize(const std::string& text, RenderSettings& settings) {
  const char *at = text.data(), *end = at + text.size();
  const auto number = [&](int& value) {
    const auto [next, error] = std::from_chars(at, end, value);
    at = next;
    return error == std::errc() && value > 0;
  };
  const bool width = number(settings.width);
  const bool cross = at != end && *at++ == 'x';
  if (!width || !cross || !number(settings.height) || at != end) {
    throw render::Error(render::ExitCode::usage,
                        "--size: '" + text + "' is no size; write WIDTHxHEIGHT, e.g. 1280x720");
  }
}

}  // namespace

void AddSceneFlags(CLI::App& command, RenderFlags& flags) {
  RenderSettings& s = flags.settings;
  command.add_option("SCENE", s.scene_path, "the scene, a .gltf or .glb file")->required();
  command
      .add_option("--scene", s.scene, "which scene of the file (default: the file's own default)")
      ->type_name("NAME|INDEX");
  command
      .add_option("--camera", s.camera, "which camera (default: the first, or one that frames all)")
      ->type_name("NAME|INDEX");
  command.add_option("--env", s.env_path, "environment map, lat-long .exr or .hdr")
      ->type_name("FILE");
  command.add_flag("--allow-outside", s.allow_outside, "let URIs leave the scene's folder");
  command.add_option("--size", flags.size, "pixels (default: 1280 wide, the camera's aspect)")
      ->type_name("WxH");
  command
      .add_option("--aov", flags.aovs,
                  "layers beside the beauty, with commas: albedo, normal, depth, stderr, count, "
                  "object, material; or all")
      ->type_name("LIST");
  command
      .add_option("--samples", flags.samples,
                  "samples per pixel at most (default: 256; no limit with --time or --noise)")
      ->type_name("N");
  command.add_option("--time", s.time_seconds, "stop rendering after so many seconds")
      ->type_name("SECONDS");
  command
      .add_option("--noise", s.noise_target, "stop at this relative standard error of the image")
      ->type_name("ERROR");
  command
      .add_option("--depth", s.max_depth,
                  "scattering vertices of a path (default: 8); 0 emission, 1 direct light")
      ->type_name("N");
  command
      .add_option("--roulette", s.roulette_depth,
                  "vertices before Russian roulette may end dark paths (default: 1)")
      ->type_name("N");
  command
      .add_option(
          "--clamp", s.clamp,
          "scale samples down to this brightest channel; the summary says what that removes")
      ->type_name("VALUE");
  command
      .add_option("--direct", flags.direct,
                  "direct light by mis (default), light or bsdf sampling; only the noise differs")
      ->type_name("NAME");
  command
      .add_option("--lights", flags.lights,
                  "light to sample chosen by the tree (default) or uniform; only the noise differs")
      ->type_name("NAME");
  command
      .add_option("--executor", flags.executor,
                  "wavefront, megakernel or auto (default), with the same image; reference: in "
                  "double, with float compared to it path by path")
      ->type_name("NAME");
  command.add_flag("--no-robust", flags.no_robust,
                   "faster rays that may slip through where triangles meet");
}

void AddMachineFlags(CLI::App& command, RenderFlags& flags) {
  RenderSettings& s = flags.settings;
  command.add_option("--threads", s.threads, "threads (default: all the process may use)")
      ->type_name("N");
  command.add_option("--memory", s.memory_mb, "MiB for path state and queues (default: by need)")
      ->type_name("MB");
  command.add_option("--batch", s.batch_items, "items per batch (default: by stage)")
      ->type_name("N");
  command
      .add_option("--policy", flags.policy,
                  "which batch is next: deepest (default), fullest or oldest")
      ->type_name("NAME");
  command.add_option("--isa", flags.isa, "instruction set: sse4, avx2, avx512 or auto (default)")
      ->type_name("NAME");
}

void AddRunFlags(CLI::App& command, RenderFlags& flags) {
  RenderSettings& s = flags.settings;
  flags.needs_output = true;
  command.add_option("-o,--output", s.output_path, "the image, an .exr file")
      ->type_name("FILE.exr");
  command.add_flag("--explain", flags.explain, "tell one path's story instead of rendering")
      ->needs(command.add_option("--pixel", flags.pixel, "which pixel's, from the top left")
                  ->type_name("X,Y"));
  command.add_option("--sample", flags.sample, "which of its samples (default: 0)")->type_name("N");
  command.add_flag("--no-png", flags.no_png, "write no tone-mapped PNG beside the image");
  command.add_option("--preview", s.preview_path, "a picture refreshed while rendering")
      ->type_name("FILE.png");
  command.add_option("--exposure", s.exposure, "brightens the PNGs by 2^EV, not the image")
      ->type_name("EV");
  command.add_option("--seed", s.seed, "another seed, another noise (default: 0)")->type_name("N");
  AddMachineFlags(command, flags);
  command.add_option("--stats", s.stats_path, "the run's report as JSON")->type_name("FILE.json");
  command
      .add_option("--trace", s.trace_path,
                  "when each worker did what; open it in ui.perfetto.dev or chrome://tracing")
      ->type_name("FILE.json");
  command.add_flag("--quiet", s.quiet, "say nothing but errors");
}

render::SampleName NamedSample(const RenderFlags& flags) {
  render::SampleName name;
  name.sample = flags.sample;
  const char *at = flags.pixel.data(), *end = at + flags.pixel.size();
  const auto [comma, bad_x] = std::from_chars(at, end, name.x);
  const bool separated = bad_x == std::errc() && comma != end && *comma == ',';
  const auto [stop, bad_y] = std::from_chars(separated ? comma + 1 : end, end, name.y);
  if (!separated || bad_y != std::errc() || stop != end || name.x < 0 || name.y < 0) {
    throw render::Error(render::ExitCode::usage,
                        "--pixel: '" + flags.pixel + "' is no pixel; write X,Y, e.g. 10,20");
  }
  return name;
}

RenderSettings Settle(const RenderFlags& flags) {
  RenderSettings s = flags.settings;
  if (!flags.size.empty()) ParseSize(flags.size, s);
  s.aovs = render::ParseAovs(flags.aovs);
  s.executor = render::ParseExecutor(flags.executor);
  s.policy = render::ParsePolicy(flags.policy);
  s.isa = render::ParseIsa(flags.isa);
  s.direct = render::ParseDirectLight(flags.direct);
  s.lights = render::ParseLightChoice(flags.lights);
  s.write_png = !flags.no_png;
  s.robust = !flags.no_robust;
  if (s.output_path.empty() && !flags.explain && flags.needs_output)
    throw render::Error(render::ExitCode::usage, "--output: no image given; add -o FILE.exr");
  if (!flags.pixel.empty() && !flags.explain) {
    throw render::Error(render::ExitCode::usage, "--pixel names a path to explain; add --explain");
  }
  const bool other_limit = s.time_seconds > 0 || s.noise_target > 0;
  s.samples = flags.samples.value_or(other_limit ? render::kMaxSamples : render::kDefaultSamples);
  render::CheckSettings(s);
  return s;
}

}  // namespace carpool::tools
