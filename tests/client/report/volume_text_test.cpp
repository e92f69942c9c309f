// Whole numbers are told to the last digit, as people and programs read them.
#include "client/report/volume_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <utility>

namespace slabstream {
namespace {

using testing::EndsWith;
using testing::StartsWith;

TEST(VolumeText, TellsWholeNumbersToTheLastDigit) {
  const auto texts = [](double value, std::int64_t rest = 0) {
    const VolumeSample sample{.inside = true, .value = value, .rest = rest};
    return std::pair(SampleText(sample), SampleJson(sample)["value"].dump());
  };
  for (const auto& [value, rest, text] : {std::tuple{12857642016.0, 0, "12857642016"},
                                          {0x1p64, -1, "18446744073709551615"},
                                          {-0x1p63, 0, "-9223372036854775808"},
                                          {0x1p53, 1, "9007199254740993"},
                                          {0.0, 0, "0"}}) {
    const auto [told, json] = texts(value, rest);
    EXPECT_THAT(told, EndsWith(std::string("  value ") + text));
    EXPECT_EQ(json, text);
  }
  EXPECT_THAT(texts(0.25).first, EndsWith("  value 0.25"));
  EXPECT_EQ(texts(0.25).second, "0.25");
  EXPECT_EQ(texts(1e300).second, "1e+300");
  EXPECT_THAT(SampleText({.inside = true}), EndsWith("  value not finite"));
}

TEST(VolumeText, TellsEveryDigitOfAValueAndOfAPoint) {
  const auto told = [](double value) { return SampleText({.at = {2000000003, 3e22, -0.5}, .inside = true, .value = value}); };
  EXPECT_THAT(told(double(0.1F)), EndsWith("  value 0.1"));
  EXPECT_THAT(told(double(1234.5678F)), EndsWith("  value 1234.5677"));
  EXPECT_THAT(told(double(1e-30F)), EndsWith("  value 1e-30"));
  EXPECT_THAT(told(0.1), EndsWith("  value 0.1"));
  EXPECT_THAT(told(1.0 / 3), EndsWith("  value 0.3333333333333333"));
  EXPECT_THAT(told(1), StartsWith("2000000003 3e+22 -0.5  voxel"));
}

}  // namespace
}  // namespace slabstream
