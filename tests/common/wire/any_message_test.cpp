// Every message survives the wire, and the envelope's own rules.
#include "common/wire/any_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "common/wire/limits.h"
#include "slabstream/v1/envelope.pb.h"
#include "tests/common/wire/decode_any_input.h"
#include "tests/common/wire/error_of.h"
#include "tests/common/wire/samples.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

std::span<const std::byte> BytesOf(const std::string& text) { return {reinterpret_cast<const std::byte*>(text.data()), text.size()}; }

TEST(AnyMessage, EverySampleSurvivesTheWire) {
  std::set<std::size_t> members;
  for (const AnyMessage& message : AllSamples()) {
    members.insert(message.index());
    const std::vector<std::byte> header = Encode(message);
    EXPECT_LT(header.size(), 16384U) << NameOf(message);
    const Result<AnyMessage> decoded = Decode(header);
    ASSERT_TRUE(decoded.ok()) << decoded.status().message();
    EXPECT_TRUE(*decoded == message) << NameOf(message);
    EXPECT_EQ(Encode(*decoded), header) << NameOf(message);
    EXPECT_TRUE(DecodeAnyInput(header));
  }
  EXPECT_EQ(members.size(), std::variant_size_v<AnyMessage>);
}

TEST(AnyMessage, HeaderBytesAreThoseOfTheDocumentation) {
  const std::string documented("\x08\x03\x9a\x04\x09\x09\x05\x00\x00\x00\x00\x00\x00\x00", 14);  // docs/wire.md, section 2
  const Result<AnyMessage> decoded = Decode(BytesOf(documented));
  ASSERT_TRUE(decoded.ok()) << decoded.status().message();
  EXPECT_TRUE(*decoded == AnyMessage(StatusQuery{.nonce = 5}));
  const std::vector<std::byte> encoded = Encode(StatusQuery{.nonce = 5});
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(encoded.data()), encoded.size()), documented);
}

TEST(AnyMessage, LongHeadersSurvive) {
  // Half as many reports as there may be, but each with all its spans and times of a clock that has run for a year: about 50 MB.
  RankReport report;
  report.stage_ns.fill(std::int64_t{1} << 55);
  report.spans.assign(kMaxSpans, Span{Stage::kRender, std::int64_t{1} << 55, std::int64_t{1} << 55});
  GroupDone done{.epoch = 1, .worker = 1, .key = {}, .reports = std::vector<RankReport>(kMaxReports / 2, report)};
  const std::vector<std::byte> header = Encode(done);
  EXPECT_LE(header.size(), kMaxHeaderBytes);
  const Result<AnyMessage> decoded = Decode(header);
  ASSERT_TRUE(decoded.ok()) << decoded.status().message();
  EXPECT_TRUE(*decoded == AnyMessage(done));
}

TEST(AnyMessage, LargestRequestFitsTheClientPlane) {
  SubmitFrame submit = Samples<SubmitFrame>().back();
  TransferFunction curve;
  for (int i = 0; i < kMaxTransferPoints; ++i) {
    curve.colors.push_back({1.0 / 3 + i, {0.1F, 0.2F, 0.3F}});
    curve.opacities.push_back({1.0 / 3 + i, 0.1, 0.2, 0.3});
  }
  submit.frame.transfer.choice = curve;
  const std::vector<std::byte> header = Encode(submit);
  EXPECT_LE(header.size(), std::size_t{kMaxRequestBytes});
  EXPECT_TRUE(DecodeAnyInput(header));
}

TEST(AnyMessage, ManyRanksSurvive) {
  GroupAssignment message = Samples<GroupAssignment>().front();
  const Box box = message.group.placements.front().box;
  message.group.placements.clear();
  message.peers = {{message.display, "inproc://display"}};
  constexpr Rank kRanks = 5000;
  for (Rank rank = 0; rank < kRanks; ++rank) {
    message.group.placements.push_back({rank, box, rank + 1});
    message.peers.push_back({rank + 1, "inproc://worker"});
  }
  message.group.schedule = {"direct-send", kRanks, {0}};
  EXPECT_TRUE(DecodeAnyInput(Encode(message)));
}

TEST(AnyMessage, NamesAreThoseOfTheSchema) {
  for (const AnyMessage& message : AllSamples()) {
    v1::Envelope envelope;
    const std::vector<std::byte> header = Encode(message);
    ASSERT_TRUE(envelope.ParseFromArray(header.data(), int(header.size())));
    const auto* field = envelope.GetReflection()->GetOneofFieldDescriptor(envelope, envelope.GetDescriptor()->oneof_decl(0));
    ASSERT_NE(field, nullptr);
    EXPECT_EQ(NameOf(message), field->message_type()->name());
  }
  EXPECT_EQ(v1::Envelope::descriptor()->oneof_decl(0)->field_count(), int(std::variant_size_v<AnyMessage>));
}

template <class Messages>
bool Takes(const AnyMessage& message) {
  const Result<Messages> decoded = Decode<Messages>(Encode(message), ExpectedPayloadBytes(message));
  EXPECT_TRUE(decoded.ok() || decoded.status().message() == std::string(NameOf(message)) + " does not belong here");
  return decoded.ok();
}

TEST(AnyMessage, EachMessageHasOnePlaceToGo) {
  for (const AnyMessage& message : AllSamples()) {
    // Owners and the coordinator tell each other some messages of other planes, too.
    const bool of_owners =
        std::visit([]<class Message>(const Message&) { return std::constructible_from<OwnerMessage, Message>; }, message);
    EXPECT_EQ((of_owners ? Takes<ToControl>(message) + Takes<CoordinatorToOwner>(message) : 0) + Takes<WorkerToCoordinator>(message) +
                  Takes<CoordinatorToWorker>(message) + Takes<WorkerToVoxels>(message) + Takes<VoxelsToWorker>(message) +
                  Takes<WorkerToWorker>(message) + Takes<WorkerToClient>(message) + Takes<ClientToCoordinator>(message) +
                  Takes<CoordinatorToClient>(message),
              1)
        << NameOf(message);
  }
  EXPECT_EQ(Decode<CoordinatorToWorker>(Encode(Stop{}), 7).status().message(), "Stop with a payload of 7 bytes");
}

TEST(AnyMessage, EnvelopeFaultsAreNamed) {
  EXPECT_EQ(Decode({}).status().message(), "Envelope.version: 0 is not the one spoken here, 3");
  v1::Envelope envelope;
  envelope.mutable_stop()->set_epoch(5);
  EXPECT_EQ(ErrorOf(envelope), "Envelope.version: 0 is not the one spoken here, 3");
  envelope.set_version(1);
  EXPECT_EQ(ErrorOf(envelope), "Envelope.version: 1 is not the one spoken here, 3");
  envelope.set_version(3);
  EXPECT_EQ(ErrorOf(envelope), "");
  envelope.clear_message();
  EXPECT_EQ(ErrorOf(envelope), "Envelope.message: none that this version knows");
  // A message with a number that is not in the schema yet: field 99, of zero bytes.
  EXPECT_EQ(Decode(BytesOf(std::string("\x08\x03\x9A\x06\x00", 5))).status().message(), "Envelope.message: none that this version knows");
  EXPECT_THAT(Decode(BytesOf("garbage")).status().message(), HasSubstr("Envelope: 7 bytes that are not a Protobuf message"));
  const std::vector<std::byte> huge(kMaxHeaderBytes + 1);
  EXPECT_EQ(Decode(huge).status().message(), "Envelope: 67108865 bytes, at most 67108864");
}

TEST(AnyMessage, TextThatIsNotUtf8IsRefusedOnArrivalAndMendedOnItsWay) {
  v1::Envelope envelope;
  envelope.set_version(1);
  envelope.mutable_frame_failed()->mutable_status()->set_code(v1::STATUS_CODE_INTERNAL);
  envelope.mutable_frame_failed()->mutable_status()->set_message("abc");
  std::string bytes = envelope.SerializeAsString();
  bytes[bytes.find("abc") + 1] = '\xFF';
  EXPECT_THAT(Decode(BytesOf(bytes)).status().message(), HasSubstr("not a Protobuf message"));

  const FrameFailed failed{.request = 1, .status = Status::NotFound("no file /data/\xE9t\xE9.nii" + std::string(5000, '!'))};
  const Result<AnyMessage> decoded = Decode(Encode(failed));
  ASSERT_TRUE(decoded.ok()) << decoded.status().message();
  const std::string message = std::get<FrameFailed>(*decoded).status.message();
  EXPECT_EQ(message.size(), kMaxTextBytes);
  EXPECT_THAT(message, testing::StartsWith("no file /data/?t?.nii!!!"));
}

TEST(AnyMessage, RefusedSubmitsCanBeAnswered) {
  SubmitFrame submit = Samples<SubmitFrame>().front();
  submit.request = 77;
  submit.frame.view.zoom = -1;
  const std::vector<std::byte> header = Encode(submit);
  const Result<AnyMessage> decoded = Decode(header);
  ASSERT_FALSE(decoded.ok());
  EXPECT_THAT(decoded.status().message(), testing::StartsWith("SubmitFrame.frame: "));
  EXPECT_THAT(decoded.status().message(), HasSubstr("zoom"));
  EXPECT_EQ(RefusalOf(header, decoded.status()), CoordinatorToClient(FrameFailed{.request = 77, .status = decoded.status()}));
  EXPECT_EQ(RefusalOf(Encode(SampleQuery{.nonce = 7}), decoded.status()), CoordinatorToClient(OrderRefused{7, decoded.status()}));
  // Also orders and questions about the service, whether a field or the payload is wrong.
  const CoordinatorToClient refused = OrderRefused{7, decoded.status()};
  EXPECT_EQ(RefusalOf(Encode(KeysOrder{.nonce = 7}), decoded.status()), refused);
  EXPECT_EQ(RefusalOf(Encode(DataOrder{.nonce = 7}), decoded.status()), refused);
  EXPECT_EQ(RefusalOf(Encode(StatusQuery{.nonce = 7}), decoded.status()), refused);
  EXPECT_EQ(RefusalOf(Encode(ShutDown{.nonce = 7}), decoded.status()), refused);
  EXPECT_FALSE(RefusalOf(Encode(CancelFrame{1}), decoded.status()));
  EXPECT_FALSE(RefusalOf({}, decoded.status()));
}

TEST(AnyMessage, PayloadLengthsAreThoseOfTheHeader) {
  const EncodedRuns runs{{PixelFormat::kDepth, {0, 0, 10, 10}, 3, 50}, Codec::kZstd, 99, 0};
  EXPECT_EQ(ExpectedPayloadBytes(FrameImage{.picture = {runs}}), 99U);
  EXPECT_EQ(ExpectedPayloadBytes(FrameReply{.shares = {{runs}, {runs, true}}, .statistics = {}}), 99U);
  EXPECT_EQ(ExpectedPayloadBytes(PartialImage{.image = runs.image, .reports = {}}), 3U * 12 + 50 * 24);
  const SharedImage shared = {.arena = {1, 2, 3}, .bounds = {5, 10, 9, 17}, .stride = 4};
  EXPECT_EQ(ExpectedPayloadBytes(PartialImage{.shared = shared, .reports = {}}), 7U * 8);
  EXPECT_EQ(ExpectedPayloadBytes(Chunk{.encoded_bytes = 17}), 17U);
  EXPECT_EQ(ExpectedPayloadBytes(Stop{}), 0U);
}

}  // namespace
}  // namespace slabstream
