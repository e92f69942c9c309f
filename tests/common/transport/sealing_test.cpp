// Frames of sealed connections: what was sealed arrives whole and once, or not at all.
#include "common/transport/sealing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "common/transport/latest_seals.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using Frame = std::vector<std::byte>;
using Frames = std::vector<Frame>;

constexpr std::uint64_t kMaxPayload = std::uint64_t{1} << 24;
constexpr std::size_t kFirstPart = kMaxSealedHeaderBytes;  // of a payload without header that fits in the first frame

std::vector<std::byte> Noise(Random& random, std::size_t bytes) {
  std::vector<std::byte> noise(bytes);
  for (std::byte& each : noise) each = std::byte(random.Integer(0, 255));
  return noise;
}

Frames FramesOf(Sealer& sealer, std::span<const std::byte> header, std::span<const std::byte> payload) {
  Frames frames;
  sealer.Begin(header, payload);
  for (PooledVector<std::byte> frame = sealer.Next(); !frame.empty(); frame = sealer.Next())
    frames.emplace_back(frame.begin(), frame.end());
  return frames;
}

auto Open(Unsealer& unsealer, std::span<const std::byte> frame) {
  static std::vector<std::byte> scratch;
  return unsealer.Open(frame, scratch);
}

bool IsForged(Unsealer& unsealer, std::span<const std::byte> frame) {
  return std::holds_alternative<Unsealer::Forged>(Open(unsealer, frame));
}
bool IsMore(Unsealer& unsealer, std::span<const std::byte> frame) { return std::holds_alternative<Unsealer::More>(Open(unsealer, frame)); }
// Of the last frame; the earlier ones must not make one.
std::optional<Unsealer::Message> OpenAll(Unsealer& unsealer, const Frames& frames) {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    auto opened = Open(unsealer, frames[i]);
    if (auto* message = std::get_if<Unsealer::Message>(&opened); message != nullptr && i + 1 == frames.size()) return std::move(*message);
    if (!std::holds_alternative<Unsealer::More>(opened)) return std::nullopt;
  }
  return std::nullopt;
}

class SealingTest : public testing::Test {
 protected:
  // A message of three frames, which the last message's number precedes.
  Frames ThreeFrames() { return FramesOf(sealer_, header_, payload_); }
  bool Arrives(const Frames& frames) {
    const std::optional<Unsealer::Message> message = OpenAll(unsealer_, frames);
    return message && message->size() == 2 && std::ranges::equal((*message)[0].span(), header_) &&
           std::ranges::equal((*message)[1].span(), payload_);
  }

  Random random_{13};
  const testing::ScopedTrace trace_{__FILE__, __LINE__, random_.trace()};
  const KeyPair worker_ = MakeKeyPair(), peer_ = MakeKeyPair(), stranger_ = MakeKeyPair();
  const Seal seal_ = *Seal::Make(worker_, peer_.public_key);
  Sealer sealer_{seal_};
  Unsealer unsealer_{*Seal::Read(seal_.ticket, worker_.public_key, peer_), kMaxPayload};
  const std::vector<std::byte> header_ = Noise(random_, 100), payload_ = Noise(random_, 2 * kSealedPartBytes + 1000);
};

TEST_F(SealingTest, MessagesOfAllSizesArriveAsTheyWere) {
  for (const std::size_t header_bytes : {std::size_t{0}, std::size_t{1}, std::size_t{300}, kMaxSealedHeaderBytes}) {
    const std::vector<std::byte> header = Noise(random_, header_bytes);
    const std::size_t first = kFirstPart - header_bytes;
    for (const std::size_t payload_bytes : {std::size_t{0}, std::size_t{1}, first, first + 1, first + kSealedPartBytes - 1,
                                            first + kSealedPartBytes, first + kSealedPartBytes + 1}) {
      const std::vector<std::byte> payload = Noise(random_, payload_bytes);
      const Frames frames = FramesOf(sealer_, header, payload);
      EXPECT_LE(frames.size(), SealedFrames(payload_bytes));
      for (const Frame& frame : frames) EXPECT_LE(frame.size(), kSealedFrameBytes);
      const std::optional<Unsealer::Message> message = OpenAll(unsealer_, frames);
      ASSERT_TRUE(message) << header_bytes << " " << payload_bytes;
      ASSERT_EQ(message->size(), payload_bytes == 0 ? 1U : 2U);
      EXPECT_TRUE(std::ranges::equal((*message)[0].span(), header));
      EXPECT_TRUE(payload_bytes == 0 || std::ranges::equal(message->back().span(), payload));
    }
  }
}

TEST_F(SealingTest, FramesShowNothingOfTheMessage) {
  const std::string plain(1000, 'h');
  const auto bytes = std::as_bytes(std::span(plain));
  const Frames one = FramesOf(sealer_, bytes, bytes), same = FramesOf(sealer_, bytes, bytes);
  for (const Frame& frame : {one[0], same[0]}) EXPECT_EQ(std::ranges::search(frame, bytes.first(4)).size(), 0U);
  EXPECT_FALSE(std::equal(one[0].begin() + kSealedPlaceBytes, one[0].end(), same[0].begin() + kSealedPlaceBytes));
}

TEST_F(SealingTest, AlteredFramesAreForgedAndTheRightOnesStillCount) {
  Frames frames = ThreeFrames();
  for (Frame& frame : frames) {
    for (int i = 0; i < 40; ++i) {
      // The first ones: each byte of the place.
      const std::size_t at = i < int(kSealedPlaceBytes) ? std::size_t(i) : random_.Integer<std::size_t>(0, frame.size() - 1);
      Frame altered = frame;
      altered[at] ^= std::byte(1 << random_.Integer(0, 7));
      EXPECT_TRUE(IsForged(unsealer_, altered)) << "byte " << at;
    }
    const bool last = &frame == &frames.back();
    ASSERT_TRUE(last || IsMore(unsealer_, frame));
  }
  auto opened = Open(unsealer_, frames.back());
  const auto* message = std::get_if<Unsealer::Message>(&opened);
  ASSERT_NE(message, nullptr);
  EXPECT_TRUE(std::ranges::equal((*message)[1].span(), payload_));
}

TEST_F(SealingTest, CutAndLengthenedFramesAreForged) {
  const Frames frames = ThreeFrames();
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{1}, kSealedPlaceBytes, kSealedPlaceBytes + kSealedTagBytes - 1,
                                  kSealedPlaceBytes + kSealedTagBytes, kSealedFrameBytes - 1}) {
    EXPECT_TRUE(IsForged(unsealer_, std::span(frames[0]).first(bytes))) << bytes;
  }
  Frame longer = frames[0];
  longer.push_back({});
  EXPECT_TRUE(IsForged(unsealer_, longer));
  EXPECT_TRUE(Arrives(frames));
}

TEST_F(SealingTest, FramesCountOnce) {
  const Frames earlier = ThreeFrames(), frames = ThreeFrames();
  ASSERT_TRUE(Arrives(earlier));
  ASSERT_TRUE(IsMore(unsealer_, frames[0]));
  for (const Frame& frame : earlier) EXPECT_TRUE(IsForged(unsealer_, frame));
  EXPECT_TRUE(IsForged(unsealer_, frames[0]));
  ASSERT_TRUE(IsMore(unsealer_, frames[1]));
  EXPECT_TRUE(IsForged(unsealer_, frames[1]));
  EXPECT_TRUE(std::holds_alternative<Unsealer::Message>(Open(unsealer_, frames[2])));
  for (const Frame& frame : frames) EXPECT_TRUE(IsForged(unsealer_, frame));
}

TEST_F(SealingTest, AnotherUnsealerGoesOnWhereThisOneEnded) {
  const Frames earlier = ThreeFrames(), frames = ThreeFrames();
  ASSERT_TRUE(Arrives(earlier));
  Unsealer next(*Seal::Read(seal_.ticket, worker_.public_key, peer_), kMaxPayload, unsealer_.last());
  for (const Frame& frame : earlier) EXPECT_TRUE(IsForged(next, frame));
  EXPECT_TRUE(OpenAll(next, frames));
}

// The cipher's key changes every 65536 messages.
TEST_F(SealingTest, LongSessionsGoOn) {
  for (int i = 0; i < 65600; ++i) ASSERT_TRUE(OpenAll(unsealer_, FramesOf(sealer_, {}, {}))) << i;
  EXPECT_TRUE(Arrives(ThreeFrames()));
}

TEST_F(SealingTest, MessagesWhoseFramesAreLostOrReorderedNeverArriveAndTheNextOneDoes) {
  for (const std::vector<std::size_t>& order : {std::vector<std::size_t>{1, 2}, {0, 2}, {0, 1}, {2}}) {  // lost
    const Frames frames = ThreeFrames();
    for (const std::size_t i : order) EXPECT_TRUE(IsMore(unsealer_, frames[i]));
    EXPECT_TRUE(Arrives(ThreeFrames()));
  }
  const Frames frames = ThreeFrames();
  EXPECT_TRUE(IsMore(unsealer_, frames[0]));
  EXPECT_TRUE(IsMore(unsealer_, frames[2]));
  EXPECT_TRUE(IsForged(unsealer_, frames[1])) << "it comes after the third one";
  EXPECT_TRUE(Arrives(ThreeFrames()));
  // A message that its sender gave up.
  sealer_.Begin(header_, payload_);
  const PooledVector<std::byte> first = sealer_.Next();
  EXPECT_TRUE(IsMore(unsealer_, first));
  EXPECT_TRUE(Arrives(ThreeFrames()));
}

TEST_F(SealingTest, PayloadsAboveTheLimitAreDropped) {
  Unsealer strict(*Seal::Read(seal_.ticket, worker_.public_key, peer_), payload_.size() - 1);
  const Frames frames = ThreeFrames();
  for (const Frame& frame : frames) EXPECT_TRUE(IsMore(strict, frame));
  const std::vector<std::byte> shorter(payload_.begin(), payload_.end() - 1);
  EXPECT_TRUE(OpenAll(strict, FramesOf(sealer_, header_, shorter)));
}

TEST_F(SealingTest, FramesOfOtherKeysSessionsAndDirectionsAreForged) {
  for (const Seal& other : {*Seal::Make(stranger_, peer_.public_key), *Seal::Make(worker_, peer_.public_key),
                            *Seal::Make(peer_, worker_.public_key), *Seal::Make(worker_, stranger_.public_key)}) {
    Sealer sealer(other);
    EXPECT_TRUE(IsForged(unsealer_, FramesOf(sealer, header_, {}).at(0)));
  }
  EXPECT_TRUE(OpenAll(unsealer_, FramesOf(sealer_, header_, {})));
}

TEST_F(SealingTest, TicketsAreOfTwoKeys) {
  EXPECT_EQ(Seal::Read(seal_.ticket, worker_.public_key, peer_)->key, seal_.key);
  EXPECT_FALSE(Seal::Read(seal_.ticket, stranger_.public_key, peer_)) << "another one's";
  EXPECT_FALSE(Seal::Read(seal_.ticket, worker_.public_key, stranger_)) << "for another one";
  EXPECT_FALSE(Seal::Read(seal_.ticket, peer_.public_key, worker_)) << "sent back";
  for (std::size_t i = 0; i < seal_.ticket.size(); ++i) {
    std::string altered = seal_.ticket;
    altered[i] = altered[i] == 'a' ? 'b' : 'a';
    EXPECT_FALSE(Seal::Read(altered, worker_.public_key, peer_)) << i;
  }
  for (const std::string& text : {std::string(), seal_.ticket + "a", seal_.ticket.substr(1), std::string(70, '"')})
    EXPECT_FALSE(Seal::Read(text, worker_.public_key, peer_)) << text;
  EXPECT_FALSE(Seal::Read(seal_.ticket, "no key", peer_));
  EXPECT_FALSE(Seal::Make(worker_, "no key"));
  // With this key the secret would be the same for everybody.
  EXPECT_FALSE(Seal::Make(worker_, std::string(40, '0')));
  EXPECT_FALSE(Seal::Read(seal_.ticket, std::string(40, '0'), peer_));
}

TEST_F(SealingTest, LaterSessionsReplaceEarlierOnesForGood) {
  LatestSeals seals(peer_, kMaxPayload);
  const auto entered = [&](const Seal& seal) {
    const std::optional<Seal> read = seals.Read(seal.ticket, worker_.public_key);
    return read && seals.Enter(worker_.public_key, *read);
  };
  EXPECT_EQ(seals.Of(worker_.public_key), nullptr);
  ASSERT_TRUE(entered(seal_));
  const Frames frames = FramesOf(sealer_, header_, {});
  ASSERT_TRUE(OpenAll(*seals.Of(worker_.public_key), frames));
  ASSERT_TRUE(entered(seal_)) << "after another connection";
  EXPECT_TRUE(IsForged(*seals.Of(worker_.public_key), frames[0])) << "it is known that they were heard";
  const Seal later = *Seal::Make(worker_, peer_.public_key);
  ASSERT_TRUE(entered(later));
  EXPECT_FALSE(entered(seal_));
  EXPECT_TRUE(IsForged(*seals.Of(worker_.public_key), FramesOf(sealer_, header_, {}).at(0)));
  Sealer sealer(later);
  EXPECT_TRUE(OpenAll(*seals.Of(worker_.public_key), FramesOf(sealer, header_, {})));
}

}  // namespace
}  // namespace slabstream
