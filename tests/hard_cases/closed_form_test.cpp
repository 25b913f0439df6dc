// Rendered images against closed forms: one named test for each scene.
#include <gtest/gtest.h>

#include "tests/hard_cases/scenes.h"

namespace carpool::test {
namespace {

std::string NameOf(const testing::TestParamInfo<ClosedForm>& info) {
  return info.param.scene.name;
}

class ClosedFormTest : public testing::TestWithParam<ClosedForm> {};

TEST_P(ClosedFormTest, Holds) {
  ExpectMean(SubjectOf(GetParam().scene), GetParam().claim);
}
INSTANTIATE_TEST_SUITE_P(Hard, ClosedFormTest, testing::ValuesIn(ClosedForms()), NameOf);

class TwinsTest : public testing::TestWithParam<Twins> {};

TEST_P(TwinsTest, AreTheSame) {
  const Twins& twins = GetParam();
  ExpectSame(SubjectOf(twins.a), SubjectOf(twins.b), twins.claim, twins.scale);
}
INSTANTIATE_TEST_SUITE_P(Hard, TwinsTest, testing::ValuesIn(AllTwins()),
                         [](const auto& info) { return info.param.b.name; });

}  // namespace
}  // namespace carpool::test
