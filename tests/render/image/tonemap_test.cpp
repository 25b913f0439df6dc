// The tone mapper, and the sRGB encoder that it and the mip chains share.
#include "render/image/tonemap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace carpool::render {
namespace {

using Codes = std::array<uint8_t, 3>;

TEST(Srgb8Encoder, GivesTheNearestCode) {
  const Srgb8Encoder& encode = Srgb8Encoder::Instance();
  for (int i = 0; i <= 200000; ++i) {
    const float linear = static_cast<float>(i) / 200000;
    const double exact = 255 * stages::LinearToSrgb(linear);
    ASSERT_NEAR(encode(linear), exact, 0.5001) << linear;
  }
  for (int code = 0; code < 256; ++code) {
    ASSERT_EQ(encode(stages::SrgbDecode8()[static_cast<size_t>(code)]), code);
  }
}

TEST(Srgb8Encoder, TakesAnyFloat) {
  const Srgb8Encoder& encode = Srgb8Encoder::Instance();
  EXPECT_EQ(encode(std::nanf("")), 0);
  EXPECT_EQ(encode(-1), 0);
  EXPECT_EQ(encode(1e-40f), 0);
  EXPECT_EQ(encode(std::nextafter(1.0f, 0.0f)), 255);
  EXPECT_EQ(encode(std::numeric_limits<float>::infinity()), 255);
}

// Values computed from the published definition in double.
TEST(PbrNeutral, FollowsItsDefinition) {
  const auto expect = [](LinearRgb in, LinearRgb out) {
    const LinearRgb got = PbrNeutral(in);
    for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(got[i], out[i], 1e-5) << in[0];
  };
  expect({0, 0, 0}, {0, 0, 0});
  expect({0.5f, 0.5f, 0.5f}, {0.46f, 0.46f, 0.46f});          // base colour and 4 % reflection
  expect({0.04f, 0.3f, 0.2f}, {0.01f, 0.27f, 0.17f});         // offset 0.04 - 6.25 x 0.04^2
  expect({1.04f, 1.04f, 1.04f}, {0.88f, 0.88f, 0.88f});       // peak 1: 1 - 0.24^2 / 0.48
  const float white = 1 - 1 / (0.15f * (2 - 0.961081f) + 1);  // peak 2: 1 - 0.24^2 / 1.48
  expect({2.0f, 0, 0}, {0.961081f, white * 0.961081f, white * 0.961081f});
}

TEST(Tonemap, ExposesByPowersOfTwo) {
  const LinearRgb color = {0.2f, 0.1f, 0.05f};
  EXPECT_EQ(Tonemap(color, ExposureScale(1)), Tonemap({0.4f, 0.2f, 0.1f}, 1));
  EXPECT_EQ(ExposureScale(-2), 0.25f);
}

TEST(Tonemap, TakesAnyRadiance) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  EXPECT_EQ(Tonemap({std::nanf(""), -3, 0}, 1), (Codes{0, 0, 0}));
  EXPECT_EQ(Tonemap({kInf, kInf, kInf}, 1), (Codes{255, 255, 255}));
  EXPECT_EQ(Tonemap({1e38f, 1e38f, 1e38f}, 1e10f), (Codes{255, 255, 255}));
  EXPECT_EQ(Tonemap({0, 0, 0}, kInf), (Codes{0, 0, 0}));
}

TEST(Tonemap, GreyStaysGreyAndGrows) {
  Codes last = {0, 0, 0};
  for (float level = 0; level < 20; level += 0.01f) {
    const Codes codes = Tonemap({level, level, level}, 1);
    ASSERT_EQ(codes[0], codes[1]);
    ASSERT_EQ(codes[0], codes[2]);
    ASSERT_GE(codes[0], last[0]);
    last = codes;
  }
  EXPECT_GT(last[0], 250);
}

}  // namespace
}  // namespace carpool::render
