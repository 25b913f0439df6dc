// Irradiances known in closed form: lights over a Lambert floor, seen as its radiance rho E / pi.
#include <cmath>
#include <numbers>

#include "tests/hard_cases/scenes.h"

namespace carpool::test {
namespace {

using std::numbers::pi;
constexpr double kRho = 0.5;

/// A floor at y = 0 whose middle, a patch so small that its irradiance is the centre's, fills the
/// image.
SceneCase OverFloor(const std::string& name) {
  SceneCase c{.name = name};
  const int floor = c.scene.AddLambert({kRho, kRho, kRho});
  c.scene.PlaceMesh(c.scene.AddQuad({-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}, floor));
  c.scene.AddCameraAbove({0, 0.2, 0}, 1e-4);
  c.settings = HardSettings(128, 1);
  return c;
}

double SeenIrradiance(double e) {
  return kRho * e / pi;
}

/// Configuration factor to the point below its centre of a rectangle 2 a by 2 b at height 1: four
/// times that of a corner's (Howell's catalogue, B-4).
double RectangleFactor(double a, double b) {
  const double ra = std::sqrt(1 + a * a), rb = std::sqrt(1 + b * b);
  return 2 / pi * (a / ra * std::atan(b / ra) + b / rb * std::atan(a / rb));
}

/// Row 26: a 2 x 2 square at height 1 gives the point below its centre E = 0.55413 pi L.
ClosedForm Square(render::DirectLight direct) {
  const double radiance = 2;
  SceneCase c = OverFloor("row26_square_" + std::string(render::Name(direct)));
  SceneBuilder& b = c.scene;
  const int lamp = b.AddLambert({0, 0, 0}, {1, 1, 1}, radiance);
  b.PlaceMesh(b.AddQuad({-1, 1, -1}, {1, 1, -1}, {1, 1, 1}, {-1, 1, 1}, lamp));
  c.settings.direct = direct;
  if (direct == render::DirectLight::bsdf) c.settings.samples = 512;
  return {26, c, {.expected = SeenIrradiance(RectangleFactor(1, 1) * pi * radiance)}};
}

/// The same square where its texture lights but the middle half: radiance is that of the point
/// that was sampled. The mean of the texture would give 0.77 of it.
ClosedForm StripedSquare(render::DirectLight direct) {
  const double radiance = 2;
  SceneCase c = OverFloor("row26_striped_square_" + std::string(render::Name(direct)));
  SceneBuilder& b = c.scene;
  const int stripes = b.AddTexture(4, 1, {0, 0, 0, 255, 255, 255, 255, 255, 255, 0, 0, 0},
                                   {{"magFilter", 9728}, {"minFilter", 9728}});  // NEAREST
  const int lamp = b.AddMaterial(
      {{"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}, {"metallicFactor", 0}}},
       {"emissiveFactor", {1, 1, 1}},
       {"emissiveTexture", {{"index", stripes}}},
       {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", radiance}}}}}});
  b.PlaceMesh(b.AddMesh({{-1, 1, -1}, {1, 1, -1}, {1, 1, 1}, {-1, 1, 1}}, {0, 1, 2, 0, 2, 3}, lamp,
                        {{0, 0}, {1, 0}, {1, 1}, {0, 1}}));
  c.settings.direct = direct;
  c.settings.samples = direct == render::DirectLight::bsdf ? 1024 : 256;
  return {26, c, {.expected = SeenIrradiance(RectangleFactor(0.5, 1) * pi * radiance)}};
}

/// Row 27: E = pi L (r/d)^2 cos. The polyhedron of 2 n meridians is inside the sphere; its outline
/// is smaller by at most (2 pi / 2n)^2 / 6 around and as much along.
ClosedForm Sphere(double tilt) {
  const double radius = 0.5, distance = 2, radiance = 3;
  constexpr int kRings = 64;
  SceneCase c = OverFloor("row27_sphere_at_" + std::to_string(static_cast<int>(tilt * 100)));
  SceneBuilder& b = c.scene;
  const int lamp = b.AddLambert({0, 0, 0}, {1, 1, 1}, radiance);
  b.PlaceMesh(b.AddSphere(radius, kRings, lamp, false),
              {distance * std::sin(tilt), distance * std::cos(tilt), 0});
  const double error = 2 * std::pow(pi / kRings, 2) / 6;
  c.settings.samples = 512;
  const double e = pi * radiance * std::pow(radius / distance, 2) * std::cos(tilt);
  return {27, c, {.expected = SeenIrradiance(e), .slack = error}};
}

/// Row 27: a disk on its axis, E = pi L r^2 / (r^2 + d^2); the fan of n triangles has less area.
ClosedForm Disk() {
  const double radius = 0.7, distance = 1.1, radiance = 3;
  constexpr int kSides = 256;
  SceneCase c = OverFloor("row27_disk");
  SceneBuilder& b = c.scene;
  std::vector<Point> points = {{0, distance, 0}};
  std::vector<uint32_t> indices;
  for (uint32_t i = 0; i < kSides; ++i) {
    const double angle = 2 * pi * i / kSides;
    points.push_back({radius * std::cos(angle), distance, radius * std::sin(angle)});
    indices.insert(indices.end(), {0u, 1 + i, 1 + (i + 1) % kSides});  // faces down
  }
  b.PlaceMesh(b.AddMesh(points, indices, b.AddLambert({0, 0, 0}, {1, 1, 1}, radiance)));
  const double e = pi * radiance * radius * radius / (radius * radius + distance * distance);
  return {27, c, {.expected = SeenIrradiance(e), .slack = std::pow(2 * pi / kSides, 2) / 6}};
}

/// Candela and lux: E = I cos / d^2 and E = lux cos, with no 4 pi.
ClosedForm Punctual(const std::string& type) {
  SceneCase c = OverFloor("row32_units_" + type);
  SceneBuilder& b = c.scene;
  nlohmann::json light = {{"type", type}, {"intensity", 12}};
  if (type == "spot") light["spot"] = {{"innerConeAngle", 0.6}, {"outerConeAngle", 0.7}};
  const double s = std::sqrt(0.5);  // shines straight down
  b.AddPunctual(light, {{"translation", {0, 2, 0}}, {"rotation", {-s, 0, 0, s}}});
  return {32, c, {.expected = SeenIrradiance(type == "directional" ? 12 : 12 / 4.0)}};
}

/// Irradiance on a floor facing +y from a lat-long map, bilinear between texel centres, by brute
/// force over the upper half.
double SkyIrradiance(const Sky& sky) {
  constexpr int kSteps = 2048;  // kinks, at texel centres, fall between steps
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double theta = (i + 0.5) / kSteps * pi / 2;
    for (int k = 0; k < kSteps; ++k) {
      const double x = (k + 0.5) / kSteps * sky.width - 0.5, y = theta / pi * sky.height - 0.5;
      const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
      const double fx = x - x0, fy = y - y0;
      const auto texel = [&](int column, int row) {
        column = (column + sky.width) % sky.width;
        row = std::min(std::max(row, 0), sky.height - 1);
        return static_cast<double>(sky.rgb[3 * (row * sky.width + column) + 1]);
      };
      const double radiance = (1 - fy) * ((1 - fx) * texel(x0, y0) + fx * texel(x0 + 1, y0)) +
                              fy * ((1 - fx) * texel(x0, y0 + 1) + fx * texel(x0 + 1, y0 + 1));
      sum += radiance * std::cos(theta) * std::sin(theta);
    }
  }
  return sum * (pi / 2 / kSteps) * (2 * pi / kSteps);
}

/// Row 30: what the sky gives is what its texels say, each at its place.
ClosedForm UnderSky(const std::string& name, const Sky& sky, int samples = 256) {
  SceneCase c = OverFloor("row30_" + name);
  c.sky = sky;
  c.settings.samples = samples;
  return {30, c, {.expected = SeenIrradiance(SkyIrradiance(sky)), .slack = 1e-6}};
}

Sky SunSky() {
  Sky sky{64, 32, std::vector<float>(64 * 32 * 3, 0)};
  for (int c = 0; c < 3; ++c) sky.rgb[3 * (9 * 64 + 20) + c] = 5000;  // elevation 36 degrees
  return sky;
}

Sky BorderedSky() {
  Sky sky{16, 8, std::vector<float>(16 * 8 * 3, 0)};
  for (int y = 1; y < 7; ++y) {
    for (int x = 1; x < 15; ++x) {
      for (int c = 0; c < 3; ++c)
        sky.rgb[3 * (y * 16 + x) + c] = static_cast<float>(1 + (x * 7 + y * 3) % 5);
    }
  }
  return sky;
}

/// Row 33: 10^4 point lights (10^5 at full length) whose powers span twelve decades, on a sphere
/// around the patch: only the sum of cos I counts.
ClosedForm ManyLights() {
  const int lights = AtFullLength() ? 100'000 : 10'000;
  SceneCase c = OverFloor("row33_lights_over_12_decades");
  double sum = 0;
  for (int i = 0; i < lights; ++i) {
    const double u = (i + 0.5) / lights, angle = i * 2.399963;  // golden angle
    const double height = 0.2 + 0.8 * u, side = std::sqrt(1 - height * height);
    const double intensity = std::pow(10.0, -9 + 12 * ((i * 7919ll) % lights) / (lights - 1.0));
    c.scene.AddPunctual(
        {{"type", "point"}, {"intensity", intensity}},
        {{"translation", {3 * side * std::cos(angle), 3 * height, 3 * side * std::sin(angle)}}});
    sum += intensity * height / 9;
  }
  c.settings.samples = 256;
  return {33, c, {.expected = SeenIrradiance(sum)}};
}

}  // namespace

std::vector<ClosedForm> LightForms() {
  using render::DirectLight;
  std::vector<ClosedForm> forms;
  for (const DirectLight direct : {DirectLight::mis, DirectLight::light, DirectLight::bsdf}) {
    forms.push_back(Square(direct));
    forms.push_back(StripedSquare(direct));
  }
  for (const double tilt : {0.0, 1.0}) forms.push_back(Sphere(tilt));
  forms.push_back(Disk());
  forms.push_back(UnderSky("one_texel", UniformSky(2)));
  forms.push_back(UnderSky("one_texel_sun", SunSky()));
  forms.push_back(UnderSky("black_borders", BorderedSky()));
  for (const char* type : {"point", "spot", "directional"}) forms.push_back(Punctual(type));
  forms.push_back(ManyLights());
  return forms;
}

}  // namespace carpool::test
