// Envelopes of other versions.
#include "common/wire/other_version.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "common/wire/any_message.h"
#include "slabstream/v1/envelope.pb.h"
#include "tests/common/wire/samples.h"

namespace slabstream {
namespace {

std::vector<std::byte> OfVersion(std::uint32_t version) {
  v1::Envelope envelope;
  envelope.set_version(version);
  std::vector<std::byte> bytes(envelope.ByteSizeLong());
  EXPECT_TRUE(envelope.SerializeToArray(bytes.data(), int(bytes.size())));
  return bytes;
}

TEST(OtherVersion, IsThatOfAnEnvelopeOfAnotherRelease) {
  for (const std::uint32_t version : {1U, kWireVersion - 1, kWireVersion + 1, 1000000U})
    EXPECT_EQ(OtherVersion(OfVersion(version)), version);
  EXPECT_EQ(OtherVersion(OfVersion(kWireVersion)), std::nullopt);
  EXPECT_EQ(OtherVersion(OfVersion(0)), std::nullopt) << "no program writes it";
  EXPECT_EQ(OtherVersion({}), std::nullopt);
  const std::vector<std::byte> noise(50, std::byte{0xff});
  EXPECT_EQ(OtherVersion(noise), std::nullopt);
  for (const AnyMessage& message : AllSamples()) EXPECT_EQ(OtherVersion(Encode(message)), std::nullopt) << NameOf(message);
}

TEST(OtherVersion, TheNoticeSaysOursAndNothingElse) {
  EXPECT_EQ(VersionNotice(), OfVersion(kWireVersion));
  EXPECT_FALSE(Decode(VersionNotice()).ok());
  EXPECT_THAT(TextOfOtherVersion(2),
              testing::AllOf(testing::HasSubstr("version 2 "), testing::HasSubstr("version " + std::to_string(kWireVersion))));
}

}  // namespace
}  // namespace slabstream
