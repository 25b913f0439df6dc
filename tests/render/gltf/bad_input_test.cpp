// Broken scenes: each gives one line with the JSON pointer of the fault, whatever the fault.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "tests/render/gltf/scene_builder.h"

namespace carpool::render {
namespace {

using ::testing::HasSubstr;

/// A quad with all kinds of top-level objects, valid until it is changed.
SceneBuilder Good() {
  SceneBuilder scene;
  scene.AddQuad();
  scene.json["meshes"][0]["primitives"][0]["material"] = 0;
  scene.json["images"] = {{{"bufferView", scene.AddView(TinyPng())}, {"mimeType", "image/png"}}};
  scene.json["samplers"] = {{{"wrapS", 10497}}};
  scene.json["textures"] = {{{"source", 0}, {"sampler", 0}}};
  scene.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  scene.json["buffers"] = Json::array({{{"byteLength", scene.binary.size()}}});
  return scene;
}

struct Fault {
  const char* pointer;  // of the property to set, and of the error unless `reported` says otherwise
  Json value;
  const char* message;
  const char* reported = nullptr;
};

const Json kHuge = 9007199254740991u;

const Fault kFaults[] = {
    // wrong types
    {"/accessors", 3, "must be an array"},
    {"/accessors/0", "x", "must be an object"},
    {"/accessors/0/count", "3", "must be an integer"},
    {"/accessors/0/count", 2.5, "must be an integer"},
    {"/accessors/0/count", nullptr, "must be an integer"},
    {"/accessors/0/type", "VEC5", "must be one of"},
    {"/accessors/0/type", 3, "must be one of"},
    {"/accessors/0/normalized", 1, "must be true or false"},
    {"/accessors/0/sparse", 1, "must be an object"},
    {"/bufferViews/0/byteLength", -1, "is -1"},
    {"/meshes/0/primitives", Json::object(), "must be an array"},
    {"/meshes/0/primitives/0", Json::array(), "must be an object"},
    {"/meshes/0/primitives/0/attributes", 1, "must be an object"},
    {"/meshes/0/primitives/0/attributes/POSITION", Json::array(), "must be an index"},
    {"/meshes/0/primitives/0/targets", 1, "must be an array"},
    {"/meshes/0/primitives/0/mode", 7, "is 7"},
    {"/meshes/0/weights", {1, "x"}, "must be a number", "/meshes/0/weights/1"},
    {"/nodes/0/matrix", {1, 2, 3}, "must have 16 numbers"},
    {"/nodes/0/matrix", 1, "must be an array of numbers"},
    {"/nodes/0/scale", {1, 2, true}, "must be a number", "/nodes/0/scale/2"},
    {"/nodes/0/translation", {1e39, 0, 0}, "is huge", "/nodes/0/translation/0"},
    {"/nodes/0/children", 0, "must be an array"},
    {"/nodes/0/extensions", 0, "must be an object"},
    {"/nodes/0/name", 0, "must be a string"},
    {"/scenes/0/nodes", {0.5}, "must be an index", "/scenes/0/nodes/0"},
    {"/scene", "0", "must be an index"},
    {"/asset", 2, "must be an object"},
    {"/asset/version", 2, "must be a string"},
    {"/extensionsUsed", "x", "must be an array"},
    {"/extensionsRequired", {1}, "must be a string", "/extensionsRequired/0"},
    {"/extensions", Json::array(), "must be an object"},
    {"/materials/0/alphaMode", "mask", "must be one of 'OPAQUE' 'MASK' 'BLEND'"},
    {"/materials/0/doubleSided", 0, "must be true or false"},
    {"/materials/0/pbrMetallicRoughness", "x", "must be an object"},
    {"/materials/0/pbrMetallicRoughness/baseColorFactor", {1, 1, 1}, "must have 4 numbers"},
    {"/materials/0/pbrMetallicRoughness/baseColorTexture", 0, "must be an object"},
    {"/materials/0/normalTexture", Json::object(), "is missing",
     "/materials/0/normalTexture/index"},
    {"/materials/0/extensions",
     {{"KHR_materials_ior", 1.5}},
     "must be an object",
     "/materials/0/extensions/KHR_materials_ior"},
    {"/samplers/0/wrapS", 1, "must be one of"},
    {"/images/0/uri", 1, "must be a string"},
    // indices out of bounds
    {"/scene", 1, "refers to scenes 1, but the file has 1"},
    {"/scenes/0/nodes", {5}, "refers to nodes 5", "/scenes/0/nodes/0"},
    {"/nodes/0/mesh", -1, "refers to meshes -1"},
    {"/nodes/0/children", {4000000000u}, "refers to nodes 4000000000", "/nodes/0/children/0"},
    {"/nodes/0/camera", 0, "refers to cameras 0, but the file has 0"},
    {"/nodes/0/skin", 0, "refers to skins 0"},
    {"/meshes/0/primitives/0/material", 1, "refers to materials 1"},
    {"/meshes/0/primitives/0/indices", 99, "refers to accessors 99"},
    {"/meshes/0/primitives/0/attributes/POSITION", 99, "refers to accessors 99"},
    {"/accessors/0/bufferView", 99, "refers to bufferViews 99"},
    {"/bufferViews/0/buffer", 1, "refers to buffers 1"},
    {"/textures/0/source", 1, "refers to images 1"},
    {"/textures/0/sampler", 1, "refers to samplers 1"},
    {"/images/0/bufferView", 99, "refers to bufferViews 99"},
    {"/materials/0/pbrMetallicRoughness/baseColorTexture/index", 1, "refers to textures 1"},
    // extents out of bounds, in every number that makes one
    {"/accessors/0/count", 5, "reads 60 bytes of buffer view 0, which has 48", "/accessors/0"},
    {"/accessors/0/count", 2147483647, "reads", "/accessors/0"},
    {"/accessors/0/count", kHuge, "is huge"},
    {"/accessors/0/byteOffset", 4, "reads 52 bytes", "/accessors/0"},
    {"/accessors/0/byteOffset", kHuge, "reads", "/accessors/0"},
    {"/accessors/0/byteOffset", 18446744073709551615u, "is huge"},
    {"/accessors/0/type", "VEC4", "reads 64 bytes", "/accessors/0"},
    {"/bufferViews/0/byteOffset", kHuge, "lie outside the buffer", "/bufferViews/0"},
    {"/bufferViews/0/byteLength", kHuge, "lie outside the buffer", "/bufferViews/0"},
    {"/bufferViews/0/byteStride", 252, "reads", "/accessors/0"},
    {"/bufferViews/0/byteStride", 256, "is 256"},
    {"/buffers/0/byteLength", kHuge, "of its 9007199254740991 bytes"},
    {"/buffers/0/byteLength", 0, "is 0"},
    // accessors that do not fit their use
    {"/meshes/0/primitives/0/attributes/POSITION", 2, "must have 3 components"},
    {"/meshes/0/primitives/0/attributes/NORMAL", 2, "must have 3 components"},
    {"/meshes/0/primitives/0/indices", 0, "indices must be SCALAR of an unsigned integer type",
     "/accessors/0"},
    {"/meshes/0/primitives/0/attributes/NORMAL", 3, "has 6 elements but POSITION has 4"},
    {"/accessors/3/componentType", 5122, "indices must be SCALAR", "/accessors/3"},
    {"/accessors/0/componentType", 5130, "must be one of"},
};

TEST(BadInput, EachFaultIsNamedWhereItIs) {
  for (const Fault& fault : kFaults) {
    SceneBuilder scene = Good();
    scene.json[Json::json_pointer(fault.pointer)] = fault.value;
    const std::string error = ErrorOf(scene);
    const std::string where =
        std::string("scene.glb: ") + (fault.reported ? fault.reported : fault.pointer);
    EXPECT_THAT(error, HasSubstr(where)) << fault.pointer << " = " << fault.value.dump();
    EXPECT_THAT(error, HasSubstr(fault.message)) << fault.pointer << " = " << fault.value.dump();
    EXPECT_THAT(error, HasSubstr("; ")) << "says nothing of what to do";
    EXPECT_EQ(error.find('\n'), std::string::npos);
  }
}

TEST(BadInput, TheSceneBehindTheFaultsIsGood) {
  EXPECT_EQ(ErrorOf(Good()), "");
}

TEST(BadInput, MissingProperties) {
  for (const char* pointer :
       {"/accessors/0/count", "/accessors/0/type", "/accessors/0/componentType",
        "/bufferViews/0/buffer", "/bufferViews/0/byteLength", "/buffers/0/byteLength",
        "/meshes/0/primitives", "/meshes/0/primitives/0/attributes", "/asset/version",
        "/materials/0/pbrMetallicRoughness/baseColorTexture/index"}) {
    SceneBuilder scene = Good();
    const Json::json_pointer at(pointer);
    scene.json[at.parent_pointer()].erase(at.back());
    EXPECT_THAT(ErrorOf(scene),
                HasSubstr(std::string("scene.glb: ") + pointer + ": this property is missing"));
  }
}

/// Every property of the good scene replaced by every kind of value: InputError or success, no
/// more.
void Replace(Json& root, const Json& values, const Json::json_pointer& at) {
  const Json original = root[at];
  SceneBuilder scene = Good();
  for (const Json& value : values) {
    root[at] = value;
    scene.json = root;
    EXPECT_NO_THROW(ErrorOf(scene)) << at.to_string() << " = " << value.dump();
  }
  root[at] = original;
  if (original.is_object()) {
    for (const auto& [key, member] : original.items()) Replace(root, values, at / key);
  } else if (original.is_array()) {
    for (size_t i = 0; i < original.size(); ++i) Replace(root, values, at / i);
  }
}

TEST(BadInput, AnyValueAnywhere) {
  const Json values = {nullptr, true,  -1,           0,
                       1,       3,     0.5,          1e300,
                       kHuge,   "",    "text",       Json::array(),
                       {0},     {"x"}, {{{"a", 1}}}, Json::object()};
  Json root = Good().json;
  const Json good = root;
  for (const auto& [key, member] : good.items()) {
    Replace(root, values, Json::json_pointer("/" + key));
  }
}

TEST(BadInput, PositionsThatAreNotFinite) {
  const float values[] = {std::numeric_limits<float>::quiet_NaN(),
                          std::numeric_limits<float>::infinity()};
  for (float value : values) {
    SceneBuilder scene;
    const int positions = scene.AddAccessor<float>("VEC3", {0, 0, 0, 1, value, 0, 0, 1, 0});
    scene.AddMesh({{"attributes", {{"POSITION", positions}}}});
    EXPECT_THAT(ErrorOf(scene), HasSubstr("/accessors/0: the position of vertex 1 is not finite"));
  }
}

TEST(BadInput, IndicesBeyondTheVertices) {
  SceneBuilder scene;
  scene.AddQuad();
  scene.json["meshes"][0]["primitives"][0]["indices"] =
      scene.AddAccessor<uint8_t>("SCALAR", {0, 1, 2, 0, 2, 4});
  EXPECT_THAT(ErrorOf(scene),
              HasSubstr("/accessors/4: index 5 is 4, but the primitive has 4 vertices"));
}

TEST(BadInput, ElementsWithoutABufferAreLimited) {
  SceneBuilder scene;
  scene.AddTriangle();
  scene.json["accessors"][0].erase("bufferView");
  scene.json["accessors"][0]["count"] = 2000000000;
  EXPECT_THAT(
      ErrorOf(scene),
      HasSubstr("/accessors/0/count: 2000000000 elements without a bufferView are too many"));
}

TEST(BadInput, SparsePartsOutOfBounds) {
  const auto error_with = [](const std::function<void(Json&)>& change) {
    SceneBuilder scene;
    scene.AddTriangle();
    const int indices = scene.AddView(std::string("\x00\x01\x02\x03", 4));
    const int values = scene.AddView(std::string(48, '\0'));
    Json& sparse = scene.json["accessors"][0]["sparse"];
    sparse = {{"count", 3},
              {"indices", {{"bufferView", indices}, {"componentType", 5121}}},
              {"values", {{"bufferView", values}}}};
    change(sparse);
    return ErrorOf(scene);
  };
  EXPECT_EQ(error_with([](Json&) {}), "");
  EXPECT_THAT(error_with([](Json& s) { s["count"] = 4; }),
              HasSubstr("/accessors/0/sparse/count: is larger"));
  EXPECT_THAT(error_with([](Json& s) { s["indices"]["byteOffset"] = 2; }),
              HasSubstr("/accessors/0/sparse/indices: reads 5"));
  EXPECT_THAT(error_with([](Json& s) { s["indices"]["byteOffset"] = 1; }),
              HasSubstr("index 2 is 3, out of range or order"));
  EXPECT_THAT(error_with([](Json& s) { s["values"]["byteOffset"] = 13; }),
              HasSubstr("/accessors/0/sparse/values: reads"));
  EXPECT_THAT(error_with([](Json& s) { s["indices"]["componentType"] = 5126; }),
              HasSubstr("/sparse/indices/componentType: must be one of"));
  EXPECT_THAT(error_with([](Json& s) { s["values"]["bufferView"] = 77; }),
              HasSubstr("/sparse/values/bufferView: refers to bufferViews 77"));
  EXPECT_THAT(error_with([](Json& s) { s.erase("values"); }),
              HasSubstr("/accessors/0/sparse/values: this property is missing"));
}

TEST(BadInput, ABufferWithoutDataIsAnErrorOnlyWhereItIsRead) {
  SceneBuilder scene = Good();
  scene.json["buffers"].push_back({{"byteLength", 100}});
  EXPECT_EQ(ErrorOf(scene), "");
  scene.json["bufferViews"][0]["buffer"] = 1;
  EXPECT_THAT(ErrorOf(scene), HasSubstr("/buffers/1: the buffer has no data"));
}

TEST(BadInput, GeometryHasALimit) {
  SceneBuilder scene;
  scene.AddQuad();
  LoadOptions options;
  options.max_geometry_bytes = 100;
  EXPECT_THAT(ErrorOf(scene, options), HasSubstr("geometry needs more than the limit"));
}

TEST(BadInput, InstancesCountTowardsTheLimit) {
  // 64 nodes that each repeat a mesh 100,000 times, from one small accessor of zeros.
  SceneBuilder scene;
  scene.AddTriangle();
  scene.json["accessors"].push_back({{"componentType", 5126}, {"count", 100000}, {"type", "VEC3"}});
  const Json instancing = {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", 1}}}}}};
  for (int n = 0; n < 64; ++n) scene.AddNode({{"mesh", 0}, {"extensions", instancing}});
  LoadOptions options;
  options.max_geometry_bytes = 64 << 20;
  EXPECT_THAT(ErrorOf(scene, options), HasSubstr("geometry needs more than the limit of 64 MiB"));
}

}  // namespace
}  // namespace carpool::render
