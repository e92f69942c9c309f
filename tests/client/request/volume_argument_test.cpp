#include "client/request/volume_argument.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

class VolumeArgumentTest : public testing::Test {
 protected:
  std::string Touch(const std::string& name) const {
    std::ofstream(directory_ / name) << "x";
    return directory_ / name;
  }
  static void Expect(const std::string& text, bool is_file, const std::string& volume, const std::string& transfer) {
    const Result<VolumeArgument> argument = ParseVolumeArgument("SOURCE", text, is_file);
    ASSERT_TRUE(argument.ok()) << argument.status().message();
    EXPECT_EQ(argument->volume, volume);
    EXPECT_EQ(argument->transfer_text, transfer);
    EXPECT_EQ(argument->transfer.has_value(), !transfer.empty());
  }

  TemporaryDirectory directory_;
};

TEST_F(VolumeArgumentTest, AFileMayBeFollowedByATransferFunction) {
  const std::string head = Touch("head.nrrd"), odd = Touch("a:opaque");
  Expect(head, true, head, "");
  Expect(head + ":opaque", true, head, "opaque");
  Expect(odd, true, odd, "");
  Expect(odd + ":ct-bone", true, odd, "ct-bone");
  Expect("missing:opaque", true, "missing:opaque", "");
  EXPECT_THAT(ParseVolumeArgument("SOURCE", head + ":bone", true).status().message(),
              testing::AllOf(HasSubstr("SOURCE '" + head + ":bone'"), HasSubstr("'bone' is not one of auto,")));
}

TEST_F(VolumeArgumentTest, OptionsForReadingStandBeforeTheTransferFunction) {
  const std::string head = Touch("head.nii");
  Expect(head + "?time=3", true, head + "?time=3", "");
  Expect(head + "?time=3:opaque", true, head + "?time=3", "opaque");
  Expect(head + "?tine=3:opaque", true, head + "?tine=3:opaque", "");
}

TEST_F(VolumeArgumentTest, AddressesAndOptionsMayHoldColons) {
  const std::string head = Touch("head.nii");
  for (const std::string whole :
       {"http://host:8080/a.zarr", "http://host:8080", "http://[::1]:8080/a", "zarr://http://host:8080/a.zarr",
        "https://host/a.zarr/|zarr3:", "s3://b/a?endpoint=http://host:9000", "s3://b/a?endpoint=http://host:9000,array=a,channel=2",
        "https://host/a?sig=a:b", "https://host/a?header=Authorization:@/run/token", "https://host/a?header=Referer:https://host/"}) {
    Expect(whole, true, whole, "");
    Expect(whole + (whole.find('?') == std::string::npos ? "?time=1:opaque" : ",time=1:opaque"), true,
           whole + (whole.find('?') == std::string::npos ? "?time=1" : ",time=1"), "opaque");
  }
  Expect("https://host/a.zarr:opaque", true, "https://host/a.zarr", "opaque");
  Expect(head + "?time=0:1,channel=1", true, head + "?time=0:1,channel=1", "");
  Expect(head + "?time=0:1", true, head + "?time=0:1", "");
}

TEST_F(VolumeArgumentTest, ADatasetsNameMayHoldAColon) {
  Expect("head:ct-skin", false, "head", "ct-skin");
  Expect("head:2026", false, "head:2026", "");
  Expect("a:b:auto", false, "a:b", "auto");
  EXPECT_THAT(ParseVolumeArgument("SOURCE", "head:no/map.json", false).status().message(), HasSubstr("no/map.json"));
}

TEST_F(VolumeArgumentTest, AColourMapMayComeFromAFile) {
  const std::string head = Touch("head.nrrd"), map = directory_ / "warm.json";
  std::ofstream(map) << R"({"RGBPoints": [0, 0, 0, 0, 9, 1, 0.5, 0]})";
  Expect(head + ":" + map, true, head, map);
}

}  // namespace
}  // namespace slabstream
