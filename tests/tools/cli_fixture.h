// What the tests of `carpool` share: a scene of one triangle, and what an error looks like.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/tools/process.h"

namespace carpool::tests {

/// A lit triangle in a folder of its own.
class CliTest : public testing::Test {
 protected:
  CliTest() { WriteFile(scene_, TriangleGltf()); }

  /// Carpool runs the program with `arguments`.
  static Outcome Carpool(std::vector<std::string> arguments) {
    return Process(Command(arguments)).Wait();
  }

  /// Command is the program's path before `arguments`.
  static std::vector<std::string> Command(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), CARPOOL_PROGRAM);
    return arguments;
  }

  /// Expects one line on standard error that holds `text`, and nothing on standard output.
  static void ExpectError(const Outcome& outcome, int exit_code, const std::string& text) {
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_EQ(outcome.err.rfind("carpool: ", 0), 0u) << outcome.err;
    EXPECT_EQ(outcome.err.find('\n') + 1, outcome.err.size()) << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }

  // Its nine floats are three corners, its camera looks at them from +Z, its light is a point.
  static std::string TriangleGltf() {
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1,2]}],
"extensionsUsed":["KHR_lights_punctual"],
"extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":20}]}},
"nodes":[{"mesh":0},{"camera":0,"translation":[0,0,3]},
  {"translation":[0,0,2],"extensions":{"KHR_lights_punctual":{"light":0}}}],
"cameras":[{"type":"perspective","perspective":{"yfov":0.8,"znear":0.1,"aspectRatio":1}}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[-1,-1,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AACAvwAAgL8AAAAAAACAPwAAgL8AAAAAAAAAAAAAgD8AAAAA"}]})";
  }

  TemporaryFolder folder_;
  const std::string scene_ = folder_ / "triangle.gltf";
};

}  // namespace carpool::tests
