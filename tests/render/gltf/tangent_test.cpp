// Tangents: the MikkTSpace rule on cases worked out by hand, and against tangents that tools wrote.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "render/gltf/normals.h"
#include "render/gltf/tangents.h"
#include "tests/render/gltf/scene_builder.h"

namespace carpool::render {
namespace {

using gltf::Primitive;
using gltf::Vec3;
using ::testing::ElementsAre;
using ::testing::FloatNear;
using ::testing::Pointwise;
using ::testing::SizeIs;

constexpr float kNoTransform[6] = {1, 0, 0, 0, 1, 0};

struct Vertex {
  Vec3 position, normal;
  double u, v;
};

Primitive Make(const std::vector<Vertex>& vertices, const std::vector<uint32_t>& indices) {
  Primitive primitive;
  primitive.uv_sets = 1;
  primitive.indices = indices;
  for (const Vertex& vertex : vertices) {
    primitive.elements.push_back(static_cast<uint32_t>(primitive.elements.size()));
    for (double x : vertex.position) primitive.positions.push_back(static_cast<float>(x));
    for (double x : vertex.normal) primitive.normals.push_back(static_cast<float>(x));
    primitive.uvs.push_back(static_cast<float>(vertex.u));
    primitive.uvs.push_back(static_cast<float>(vertex.v));
  }
  return primitive;
}

/// The tangent (x, y, z, w) at a corner of the triangle list.
std::vector<float> At(const Primitive& primitive, size_t corner) {
  const auto begin = primitive.tangents.begin() + primitive.indices[corner] * 4;
  return {begin, begin + 4};
}

void ExpectTangent(const Primitive& primitive, size_t corner, const std::vector<float>& expected) {
  EXPECT_THAT(At(primitive, corner), Pointwise(FloatNear(1e-6f), expected)) << "corner " << corner;
}

constexpr Vec3 kUp = {0, 0, 1};

/// A unit square facing +z; u to the right, v down, as an upright picture has it.
std::vector<Vertex> UprightQuad() {
  return {{{0, 0, 0}, kUp, 0, 1},
          {{1, 0, 0}, kUp, 1, 1},
          {{1, 1, 0}, kUp, 1, 0},
          {{0, 1, 0}, kUp, 0, 0}};
}

TEST(Tangent, OfAnUprightPicture) {
  // The bitangent cross(n, t) w must point up in the picture, against v.
  Primitive quad = Make(UprightQuad(), {0, 1, 2, 0, 2, 3});
  GenerateTangents(quad, 0, kNoTransform);
  for (size_t corner = 0; corner < 6; ++corner) ExpectTangent(quad, corner, {1, 0, 0, 1});
  EXPECT_EQ(quad.vertex_count(), 4u);
}

TEST(Tangent, OfAMirroredPicture) {
  std::vector<Vertex> vertices = UprightQuad();
  for (Vertex& vertex : vertices) vertex.u = 1 - vertex.u;
  Primitive quad = Make(vertices, {0, 1, 2, 0, 2, 3});
  GenerateTangents(quad, 0, kNoTransform);
  for (size_t corner = 0; corner < 6; ++corner) ExpectTangent(quad, corner, {-1, 0, 0, -1});
}

TEST(Tangent, FollowsTheTextureTransform) {
  Primitive quad = Make(UprightQuad(), {0, 1, 2, 0, 2, 3});
  const float quarter_turn[6] = {0, 1, 0, -1, 0, 1};  // u' = v, v' = 1 - u
  GenerateTangents(quad, 0, quarter_turn);
  for (size_t corner = 0; corner < 6; ++corner) ExpectTangent(quad, corner, {0, -1, 0, 1});
}

TEST(Tangent, VerticesOnAMirrorSeamAreSplit) {
  // Two quads that share the edge x = 1, where u turns back: the same vertices, opposite
  // orientation.
  std::vector<Vertex> vertices = UprightQuad();
  vertices.push_back({{2, 0, 0}, kUp, 0, 1});
  vertices.push_back({{2, 1, 0}, kUp, 0, 0});
  Primitive strip = Make(vertices, {0, 1, 2, 0, 2, 3, 1, 4, 5, 1, 5, 2});
  GenerateTangents(strip, 0, kNoTransform);
  for (size_t corner = 0; corner < 6; ++corner) ExpectTangent(strip, corner, {1, 0, 0, 1});
  for (size_t corner = 6; corner < 12; ++corner) ExpectTangent(strip, corner, {-1, 0, 0, -1});
  EXPECT_EQ(strip.vertex_count(), 8u);
  EXPECT_THAT(strip.elements, ElementsAre(0, 1, 2, 3, 4, 5, 1, 2));
  EXPECT_EQ(strip.uvs.size(), 16u);
  EXPECT_EQ(strip.normals.size(), 24u);
}

/// Three triangles around the origin in the plane z = 0, the first with another direction of u.
TEST(Tangent, IsTheMeanWeightedByTheAngleAtTheVertex) {
  // Around vertex 0: a triangle of 90 degrees with u along +x, and one of 45 degrees with u along
  // +y.
  const std::vector<Vertex> vertices = {{{0, 0, 0}, kUp, 0, 0},
                                        {{1, 0, 0}, kUp, 1, 0},
                                        {{0, 1, 0}, kUp, 0, -1},
                                        {{-1, 1, 0}, kUp, -1, -1.5}};
  Primitive fan = Make(vertices, {0, 1, 2, 0, 2, 3});
  GenerateTangents(fan, 0, kNoTransform);
  // Second triangle: d1 = (0,1), d2 = (-1,1), uv1 = (0,-1), uv2 = (-1,-1.5); along u: (v2 d1 - v1
  // d2) / area.
  const double area = 0 * -1.5 - -1.0 * -1.0;
  Vec3 second = gltf::Scale({-1.5 * 0 + 1 * -1.0, -1.5 * 1 + 1 * 1.0, 0}, 1 / area);
  second = gltf::NormalizeOr(second, kUp);
  const double right = std::acos(0), half = std::acos(std::sqrt(0.5));
  const Vec3 mean =
      gltf::NormalizeOr(gltf::Add(gltf::Scale({1, 0, 0}, right), gltf::Scale(second, half)), kUp);
  ExpectTangent(fan, 0, {static_cast<float>(mean[0]), static_cast<float>(mean[1]), 0, 1});
  ExpectTangent(fan, 1, {1, 0, 0, 1});
  ExpectTangent(fan, 5, {static_cast<float>(second[0]), static_cast<float>(second[1]), 0, 1});
}

TEST(Tangent, TrianglesThatShareNoEdgeDoNotMix) {
  // Two triangles meet in the origin only; one has u along x, the other along y.
  const std::vector<Vertex> vertices = {{{0, 0, 0}, kUp, 0, 0},
                                        {{1, 0, 0}, kUp, 1, 0},
                                        {{1, 1, 0}, kUp, 1, -1},
                                        {{-1, 0, 0}, kUp, 0, 1},
                                        {{-1, -1, 0}, kUp, -1, 1}};
  Primitive pair = Make(vertices, {0, 1, 2, 0, 3, 4});
  GenerateTangents(pair, 0, kNoTransform);
  ExpectTangent(pair, 0, {1, 0, 0, 1});
  ExpectTangent(pair, 3, {0, 1, 0, -1});  // v grows towards -x, so the bitangent is +x
  EXPECT_EQ(pair.vertex_count(), 6u);
}

TEST(Tangent, VerticesEqualInAllButNumberAreOne) {
  // The same fan as two separate triangles: welding must give the same mean at the shared corners.
  const std::vector<Vertex> shared = {{{0, 0, 0}, kUp, 0, 0},
                                      {{1, 0, 0}, kUp, 1, 0},
                                      {{0, 1, 0}, kUp, 0, -1},
                                      {{-1, 1, 0}, kUp, -1, -1.5}};
  Primitive indexed = Make(shared, {0, 1, 2, 0, 2, 3});
  Primitive loose =
      Make({shared[0], shared[1], shared[2], shared[0], shared[2], shared[3]}, {0, 1, 2, 3, 4, 5});
  GenerateTangents(indexed, 0, kNoTransform);
  GenerateTangents(loose, 0, kNoTransform);
  for (size_t corner = 0; corner < 6; ++corner) EXPECT_EQ(At(indexed, corner), At(loose, corner));
}

TEST(Tangent, OtherNormalsMakeOtherGroups) {
  // A hard edge: the same positions and UVs, but each triangle has its own normal there.
  const Vec3 left = {-1, 0, 0};
  const std::vector<Vertex> vertices = {{{0, 0, 0}, kUp, 0, 0},   {{1, 0, 0}, kUp, 1, 0},
                                        {{0, 1, 0}, kUp, 0, -1},  {{0, 0, 0}, left, 0, 0},
                                        {{0, 1, 0}, left, 0, -1}, {{0, 0, -1}, left, -1, 0}};
  Primitive corner = Make(vertices, {0, 1, 2, 3, 4, 5});
  GenerateTangents(corner, 0, kNoTransform);
  ExpectTangent(corner, 0, {1, 0, 0, 1});
  ExpectTangent(corner, 3, {0, 0, 1, 1});
}

TEST(Tangent, WithoutUsableUvIsSomePerpendicular) {
  std::vector<Vertex> vertices = UprightQuad();
  for (Vertex& vertex : vertices) vertex.u = vertex.v = 0.5;
  Primitive quad = Make(vertices, {0, 1, 2, 0, 2, 3});
  GenerateTangents(quad, 0, kNoTransform);
  for (size_t corner = 0; corner < 6; ++corner) {
    const std::vector<float> tangent = At(quad, corner);
    EXPECT_NEAR(tangent[0] * tangent[0] + tangent[1] * tangent[1], 1, 1e-6);
    EXPECT_EQ(tangent[2], 0);
    EXPECT_EQ(std::fabs(tangent[3]), 1);
  }
}

TEST(Tangent, ADegenerateTriangleTakesItsNeighboursTangent) {
  std::vector<Vertex> vertices = UprightQuad();
  Primitive quad = Make(vertices, {0, 1, 2, 0, 2, 3, 1, 1, 2});
  GenerateTangents(quad, 0, kNoTransform);
  for (size_t corner = 0; corner < 9; ++corner) ExpectTangent(quad, corner, {1, 0, 0, 1});
  EXPECT_EQ(quad.vertex_count(), 4u);
}

TEST(Tangent, AThousandTrianglesOnOneEdgeStayFast) {
  // Every triangle shares the edge (0, 1); a search per triangle would take quadratic time.
  constexpr int kFins = 100000;
  std::vector<Vertex> vertices = {{{0, 0, 0}, kUp, 0, 0}, {{1, 0, 0}, kUp, 1, 0}};
  std::vector<uint32_t> indices;
  for (int k = 0; k < kFins; ++k) {
    vertices.push_back({{0, 1, 1e-3 * k}, kUp, 0, -1});
    const auto third = static_cast<uint32_t>(k + 2);
    indices.insert(indices.end(), {k % 2 ? 1u : 0u, k % 2 ? 0u : 1u, third});
  }
  Primitive fins = Make(vertices, indices);
  GenerateTangents(fins, 0, kNoTransform);
  EXPECT_EQ(fins.tangents.size(), fins.vertex_count() * 4);
}

/// A quad with a normal map, and NORMAL and TANGENT as asked.
SceneBuilder NormalMapped(bool normals, const std::vector<float>& tangents) {
  SceneBuilder scene;
  scene.AddQuad();
  Json& primitive = scene.json["meshes"][0]["primitives"][0];
  primitive["material"] = 0;
  if (!normals) primitive["attributes"].erase("NORMAL");
  if (!tangents.empty())
    primitive["attributes"]["TANGENT"] = scene.AddAccessor<float>("VEC4", tangents);
  scene.json["images"] = {{{"bufferView", scene.AddView(TinyPng())}, {"mimeType", "image/png"}}};
  scene.json["textures"] = {{{"source", 0}}};
  scene.json["materials"] = {{{"normalTexture", {{"index", 0}}}}};
  return scene;
}

TEST(Tangent, GivenOnesAreKeptAndMended) {
  const std::vector<float> given = {0, 3, 0, -1, 1, 0, 0, 0.5f, 1, 0, 5, 1, 0, 0, 0, 1};
  const ImportedScene imported = Load(NormalMapped(true, given));
  const std::vector<float> tangents =
      Stream(imported, 0, imported.geometry.shapes.at(0).tangents, 4);
  ASSERT_THAT(tangents, SizeIs(16));
  EXPECT_THAT(tangents,
              Pointwise(FloatNear(1e-6f), std::vector<float>{0, 1, 0, -1, 1, 0, 0, 1, 1, 0, 0, 1,
                                                             tangents[12], tangents[13], 0, 1}));
  EXPECT_NEAR(std::hypot(tangents[12], tangents[13]), 1, 1e-6);
}

TEST(Tangent, MissingOnesAreMadeOnlyForNormalMaps) {
  const ImportedScene with = Load(NormalMapped(true, {}));
  EXPECT_THAT(Stream(with, 0, with.geometry.shapes.at(0).tangents, 4),
              ElementsAre(1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1));
  SceneBuilder plain = NormalMapped(true, {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1});
  plain.json["materials"][0].erase("normalTexture");
  EXPECT_EQ(Load(plain).geometry.shapes.at(0).tangents, stages::kNone);
}

TEST(Tangent, AFlatMeshGetsTangentsAndStaysFlat) {
  // Given tangents are ignored there, as the specification says.
  const ImportedScene imported = Load(NormalMapped(false, std::vector<float>(16, 0.5f)));
  const stages::Shape& shape = imported.geometry.shapes.at(0);
  EXPECT_FALSE(shape.smooth);
  EXPECT_EQ(shape.vertex_count, 6);
  EXPECT_THAT(Stream(imported, 0, shape.tangents, 4),
              ElementsAre(1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1));
}

}  // namespace
}  // namespace carpool::render
