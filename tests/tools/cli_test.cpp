// The command line itself: help, versions, refusals, and `carpool info`.
#include <cstdlib>
#include <string>
#include <utility>

#include "tests/tools/cli_fixture.h"

namespace carpool::tests {
namespace {

TEST_F(CliTest, HelpGoesToStandardOutput) {
  const Outcome outcome = Carpool({"--help"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  for (const char* command : {"render", "plan", "info"}) {
    EXPECT_NE(outcome.out.find(command), std::string::npos) << outcome.out;
    const Outcome own = Carpool({command, "--help"});
    EXPECT_EQ(own.exit_code, 0);
    EXPECT_NE(own.out.find("SCENE"), std::string::npos) << own.out;
  }
}

TEST_F(CliTest, Version) {
  const Outcome outcome = Carpool({"--version"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.out, "carpool " CARPOOL_VERSION "\n");
  EXPECT_EQ(outcome.err, "");
}

TEST_F(CliTest, WrongCommandLinesAreRefused) {
  const std::string image = folder_ / "out.exr";
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{}, "missing a command"},
      {{"paint"}, "paint"},
      {{"info"}, "SCENE"},
      {{"info", scene_, "--bogus"}, "--bogus"},
      {{"info", scene_, scene_}, "triangle.gltf"},
      {{"render", scene_}, "--output"},
      {{"render", scene_, "-o", folder_ / "out.png"}, ".exr"},
      {{"render", scene_, "-o", image, "--size", "640"}, "--size"},
      {{"render", scene_, "-o", image, "--size", "0x4"}, "--size"},
      {{"render", scene_, "-o", image, "--size", "4x4x4"}, "--size"},
      {{"render", scene_, "-o", image, "--size", "99999999999x4"}, "--size"},
      {{"render", scene_, "-o", image, "--samples", "0"}, "--samples"},
      {{"render", scene_, "-o", image, "--samples", "-3"}, "--samples"},
      {{"render", scene_, "-o", image, "--samples", "many"}, "--samples"},
      {{"render", scene_, "-o", image, "--samples", "99999999999"}, "--samples"},
      {{"render", scene_, "-o", image, "--time", "nan"}, "--time"},
      {{"render", scene_, "-o", image, "--seed", "-1"}, "--seed"},
      {{"render", scene_, "-o", image, "--aov", "beauty"}, "--aov"},
      {{"render", scene_, "-o", image, "--executor", "gpu"}, "--executor"},
      {{"render", scene_, "-o", image, "--policy", "best"}, "--policy"},
      {{"render", scene_, "-o", image, "--isa", "mmx"}, "--isa"},
      {{"render", scene_, "-o", image, "--direct", "luck"}, "--direct"},
      {{"render", scene_, "-o", image, "--clamp", "-1"}, "--clamp"},
      {{"render", scene_, "-o", image, "--pixel", "1,1"}, "--explain"},
      {{"render", scene_, "--pixel", "1", "--explain"}, "--pixel"},
      {{"render", scene_, "--size", "4x4", "--pixel", "4,0", "--explain"}, "--pixel"},
      {{"plan", scene_, "--depth", "-1"}, "--depth"},
  };
  for (const auto& [arguments, text] : cases) {
    SCOPED_TRACE(text);
    ExpectError(Carpool(arguments), 2, text);
  }
  EXPECT_EQ(folder_.Files(), std::vector<std::string>{"triangle.gltf"});
}

TEST_F(CliTest, InfoDescribesTheScene) {
  const Outcome outcome = Carpool({"info", scene_});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  EXPECT_NE(outcome.out.find("triangle"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("KHR_lights_punctual"), std::string::npos) << outcome.out;
}

TEST_F(CliTest, InfoAsJsonIsOneObject) {
  const Outcome outcome = Carpool({"info", scene_, "--json"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.out.front(), '{');
  EXPECT_EQ(outcome.out.substr(outcome.out.size() - 2), "}\n");
}

TEST_F(CliTest, BadScenesAreRefusedByEveryCommand) {
  WriteFile(folder_ / "short.glb", std::string("glTF\2\0\0\0\0\1\0\0", 12));  // promises 256 bytes
  WriteFile(folder_ / "text.gltf", "{\"asset\": ");
  for (const std::string name : {"absent.gltf", "short.glb", "text.gltf"}) {
    SCOPED_TRACE(name);
    ExpectError(Carpool({"info", folder_ / name}), 3, name);
    ExpectError(Carpool({"plan", folder_ / name}), 3, name);
    ExpectError(Carpool({"render", folder_ / name, "-o", folder_ / "out.exr", "--quiet"}), 3, name);
  }
  ExpectError(Carpool({"info", folder_ / ""}), 3, "not a regular file");
}

TEST_F(CliTest, ResultsThatCannotBeWrittenAreAnError) {
  const Outcome outcome = Process(Command({"info", scene_}), "/dev/full").Wait();
  ExpectError(outcome, 4, "standard output");
}

}  // namespace
}  // namespace carpool::tests
