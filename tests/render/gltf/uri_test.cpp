// URIs: odd names that must work, and ways out of the scene's folder that must not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "render/gltf/uri.h"
#include "tests/render/gltf/scene_builder.h"

namespace carpool::render {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// A folder `scene` with a .gltf whose buffer has the given URI, beside a file `outside.bin`.
class UriTest : public ::testing::Test {
 protected:
  UriTest() {
    scene_.AddQuad();
    fs::create_directories(folder_ / "scene/sub");
    WriteText(folder_ / "outside.bin", scene_.binary);
  }

  void Store(const std::string& name) { WriteText(folder_ / ("scene/" + name), scene_.binary); }

  std::string ErrorOfUri(const std::string& uri, bool allow_outside = false) {
    scene_.json["buffers"] = Json::array({{{"byteLength", scene_.binary.size()}, {"uri", uri}}});
    LoadOptions options;
    options.allow_outside = allow_outside;
    return ErrorOf(scene_.WriteGltf(folder_ / "scene/scene.gltf"), options);
  }

  TemporaryFolder folder_;
  SceneBuilder scene_;
};

TEST_F(UriTest, NamesInTheFolder) {
  for (const char* name : {"data.bin", "with blank.bin", "umlaut \xC3\xA4.bin", "sub/data.bin",
                           "100%.bin", "a%20b.bin"}) {
    Store(name);
    EXPECT_EQ(ErrorOfUri(name), "") << name;
  }
  EXPECT_EQ(ErrorOfUri("with%20blank.bin"), "");
  EXPECT_EQ(ErrorOfUri("umlaut%20%C3%a4.bin"), "");
  EXPECT_EQ(ErrorOfUri("./sub/../data.bin"), "");
}

TEST_F(UriTest, WaysOutAreRefused) {
  const std::string absolute = (folder_ / "outside.bin").string();
  fs::create_symlink(folder_ / "outside.bin", folder_ / "scene/link.bin");
  fs::create_directory_symlink(folder_.path(), folder_ / "scene/up");
  for (const std::string& uri :
       {std::string("../outside.bin"), std::string("sub/../../outside.bin"),
        std::string("%2e%2e/outside.bin"), std::string("..%2Foutside.bin"),
        std::string("%2E%2E%2Foutside.bin"), std::string("./../outside.bin"), absolute,
        "%2F" + absolute.substr(1), std::string("link.bin"), std::string("up/outside.bin"),
        std::string("../scene/../outside.bin")}) {
    EXPECT_THAT(ErrorOfUri(uri), HasSubstr("/buffers/0/uri: URI '")) << uri;
    EXPECT_THAT(ErrorOfUri(uri), HasSubstr("leaves the scene's folder")) << uri;
    EXPECT_EQ(ErrorOfUri(uri, true), "") << uri;
  }
}

TEST_F(UriTest, DoubleEncodingIsDecodedOnce) {
  EXPECT_THAT(ErrorOfUri("%252e%252e/outside.bin"), HasSubstr("does not exist"));
}

TEST_F(UriTest, LinksInsideTheFolderAreFine) {
  Store("data.bin");
  fs::create_symlink("data.bin", folder_ / "scene/alias.bin");
  EXPECT_EQ(ErrorOfUri("alias.bin"), "");
}

TEST_F(UriTest, OtherSchemesAndEmptyNames) {
  EXPECT_THAT(ErrorOfUri("http://example.com/a.bin"), HasSubstr("scheme"));
  EXPECT_THAT(ErrorOfUri("file:///etc/passwd"), HasSubstr("scheme"));
  EXPECT_THAT(ErrorOfUri("FILE:etc"), HasSubstr("scheme"));
  EXPECT_THAT(ErrorOfUri("http://example.com/a.bin", true), HasSubstr("scheme"));
  EXPECT_THAT(ErrorOfUri(""), HasSubstr("names no file"));
  EXPECT_THAT(ErrorOfUri("a%00.bin"), HasSubstr("names no file"));
  EXPECT_THAT(ErrorOfUri("."), HasSubstr("not a regular file"));
  EXPECT_THAT(ErrorOfUri("sub"), HasSubstr("not a regular file"));
}

TEST_F(UriTest, MissingAndShortFiles) {
  EXPECT_THAT(ErrorOfUri("none.bin"), HasSubstr("/buffers/0/uri: file '"));
  EXPECT_THAT(ErrorOfUri("none.bin"), HasSubstr("does not exist"));
  WriteText(folder_ / "scene/short.bin", "abc");
  EXPECT_THAT(ErrorOfUri("short.bin"), HasSubstr("/buffers/0/byteLength: the buffer has 3 of its"));
}

TEST_F(UriTest, BrokenDataUris) {
  EXPECT_THAT(ErrorOfUri("data:application/octet-stream"), HasSubstr("has no ','"));
  EXPECT_THAT(ErrorOfUri("data:;base64,AA!A"), HasSubstr("not valid base64"));
  EXPECT_THAT(ErrorOfUri("data:;base64,AAAAA"), HasSubstr("cut off"));
  EXPECT_THAT(ErrorOfUri("data:;base64,AAAA"), HasSubstr("/buffers/0/byteLength"));
}

TEST_F(UriTest, FilesTogetherHaveALimit) {
  Store("data.bin");
  scene_.json["buffers"] =
      Json::array({{{"byteLength", scene_.binary.size()}, {"uri", "data.bin"}}});
  const fs::path path = scene_.WriteGltf(folder_ / "scene/scene.gltf");
  LoadOptions options;
  options.max_file_bytes = fs::file_size(path) + scene_.binary.size() - 1;
  EXPECT_THAT(ErrorOf(path, options), HasSubstr("more bytes than the limit"));
  ++options.max_file_bytes;
  EXPECT_EQ(ErrorOf(path, options), "");
}

std::string DecodedText(const std::string& uri) {
  gltf::ByteBudget budget;
  const std::vector<std::byte> bytes = gltf::DecodeDataUri(uri, "test", budget);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(DataUri, DecodesBase64AndEscapes) {
  EXPECT_EQ(DecodedText("data:text/plain;base64,"), "");
  EXPECT_EQ(DecodedText("data:text/plain;base64,Zg=="), "f");
  EXPECT_EQ(DecodedText("data:;base64,Zm8="), "fo");
  EXPECT_EQ(DecodedText("data:;base64,Zm9v"), "foo");
  EXPECT_EQ(DecodedText("data:;base64,Zm8%3D"), "fo");
  EXPECT_EQ(DecodedText("data:;base64,-_-_"), DecodedText("data:;base64,+/+/"));
  EXPECT_EQ(DecodedText("data:text/plain,a%20b%2"), "a b%2");
  for (size_t n = 0; n < 100; ++n) {
    std::string bytes;
    for (size_t i = 0; i < n; ++i) bytes += static_cast<char>(i * 37 + n);
    EXPECT_EQ(DecodedText("data:;base64," + Base64(bytes)), bytes);
  }
}

}  // namespace
}  // namespace carpool::render
