// `carpool render` and `carpool plan` from outside: files, streams, signals and exit codes.
#include <csignal>
#include <string>
#include <vector>

#include "tests/tools/cli_fixture.h"

namespace carpool::tests {
namespace {

constexpr char kExrMagic[] = "\x76\x2f\x31\x01";
constexpr char kPngMagic[] = "\x89PNG";

class RenderCliTest : public CliTest {
 protected:
  /// A small render with `more` flags.
  std::vector<std::string> Render(const std::vector<std::string>& more) const {
    std::vector<std::string> arguments = {"render", scene_,  "-o",        image_,
                                          "--size", "32x32", "--threads", "2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  /// Starts a render that would take hours and waits until it renders.
  static void WaitUntilRendering(Process& process) {
    ASSERT_TRUE(process.WaitForError("render")) << process.Wait().err;
  }

  void ExpectImage() const {
    EXPECT_EQ(ReadFile(image_).substr(0, 4), kExrMagic);
    EXPECT_EQ(ReadFile(folder_ / "out.png").substr(0, 4), kPngMagic);
  }

  const std::string image_ = folder_ / "out.exr";
};

using Names = std::vector<std::string>;

TEST_F(RenderCliTest, WritesBothImagesAndNothingElse) {
  const Outcome outcome = Carpool(Render({"--samples", "4"}));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  ExpectImage();
  EXPECT_EQ(folder_.Files(), (Names{"out.exr", "out.png", "triangle.gltf"}));
  EXPECT_NE(outcome.err.find("render"), std::string::npos) << outcome.err;  // progress
  EXPECT_NE(outcome.out.find(image_), std::string::npos) << outcome.out;    // result
}

TEST_F(RenderCliTest, QuietSaysNothing) {
  const Outcome outcome = Carpool(Render({"--samples", "4", "--quiet"}));
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.out + outcome.err, "");
  ExpectImage();
}

TEST_F(RenderCliTest, WritesWhatIsAskedFor) {
  const std::string stats = folder_ / "stats.json", preview = folder_ / "preview.png",
                    trace = folder_ / "trace.json";
  const Outcome outcome =
      Carpool(Render({"--samples", "4", "--no-png", "--aov", "all", "--stats", stats, "--preview",
                      preview, "--trace", trace}));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(folder_.Files(), (Names{"out.exr", "preview.png", "stats.json", "trace.json", "triangle.gltf"}));
  EXPECT_EQ(ReadFile(stats).front(), '{');
  EXPECT_NE(ReadFile(trace).find(R"("ph":"X","name":"shade","cat":"batch")"), std::string::npos);
  EXPECT_EQ(ReadFile(preview).substr(0, 4), kPngMagic);
}

TEST_F(RenderCliTest, TheReferenceListsTheWorstPaths) {
  const std::string stats = folder_ / "stats.json";
  const Outcome outcome =
      Carpool(Render({"--samples", "4", "--executor", "reference", "--stats", stats}));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  ExpectImage();
  EXPECT_NE(outcome.out.find("float against double: 4096 paths"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find(" sample "), std::string::npos) << outcome.out;
  EXPECT_NE(ReadFile(stats).find(R"("worst")"), std::string::npos);
}

TEST_F(RenderCliTest, TimeEndsARenderThatWouldTakeHours) {
  const Outcome outcome = Carpool(Render({"--time", "0.3"}));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  ExpectImage();
}

TEST_F(RenderCliTest, OutputThatCannotBeWrittenIsRefusedBeforeRendering) {
  for (const std::string name : {"triangle.gltf/out.exr", "absent/out.exr"}) {
    std::vector<std::string> arguments = Render({"--samples", "1000000", "--quiet"});
    arguments[3] = folder_ / name;
    ExpectError(Carpool(arguments), 4, name);
  }
  EXPECT_EQ(folder_.Files(), Names{"triangle.gltf"});
}

TEST_F(RenderCliTest, FailureLeavesTheOldImageAlone) {
  WriteFile(image_, "old image");
  WriteFile(scene_, TriangleGltf().substr(0, 300));
  ExpectError(Carpool(Render({"--quiet"})), 3, "triangle.gltf");
  EXPECT_EQ(ReadFile(image_), "old image");
  EXPECT_EQ(folder_.Files(), (Names{"out.exr", "triangle.gltf"}));
}

TEST_F(RenderCliTest, FirstSignalSavesWhatIsRendered) {
  for (const int signal : {SIGINT, SIGTERM}) {
    Process process(Command(Render({"--samples", "1000000"})));
    WaitUntilRendering(process);
    process.Signal(signal);
    EXPECT_EQ(process.Wait().exit_code, 130);
    ExpectImage();
    EXPECT_EQ(folder_.Files(), (Names{"out.exr", "out.png", "triangle.gltf"}));
  }
}

TEST_F(RenderCliTest, SecondSignalEndsItEvenIfItWasNotYetSaved) {
  Process process(Command(Render({"--samples", "1000000"})));
  WaitUntilRendering(process);
  process.Signal(SIGINT);
  process.Signal(SIGINT);
  EXPECT_EQ(process.Wait().exit_code, 130);
}

TEST_F(RenderCliTest, PlanSaysWhatIsSimulated) {
  const Outcome text = Carpool({"plan", scene_});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_NE(text.out.find("intersect"), std::string::npos) << text.out;
  const Outcome json = Carpool({"plan", scene_, "--json", "--dot", folder_ / "plan.dot"});
  EXPECT_EQ(json.exit_code, 0) << json.err;
  EXPECT_EQ(json.out.front(), '{');
  EXPECT_EQ(ReadFile(folder_ / "plan.dot").rfind("digraph", 0), 0u);
}

TEST_F(RenderCliTest, PlanThatCannotBeWrittenIsAnError) {
  ExpectError(Carpool({"plan", scene_, "--dot", folder_ / "absent/plan.dot"}), 4, "plan.dot");
}

}  // namespace
}  // namespace carpool::tests
