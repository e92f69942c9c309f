// Images that stay in the memory of their worker: lent, borrowed, taken back, and described wrongly.
#include <fcntl.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>

#include "common/memory/pooled_vector.h"
#include "tests/service/outputs.h"
#include "tests/service/pictures.h"
#include "tests/support/random_image.h"

namespace slabstream {
namespace {

constexpr PixelBounds kFrame = {0, 0, 400, 300};
constexpr PixelRange kWhole = {0, 400 * 300};
constexpr GroupKey kKey = {.frame = 3, .attempt = 1, .group = 2};
constexpr Time kNow = Time::min();

class SharedImagesTest : public testing::TestWithParam<PixelFormat> {
 protected:
  SharedImagesTest() { CHECK(ShareBlocks().ok()); }

  LocalImage Picture() {
    LocalImage image = RandomImage(random_, GetParam(), {20, 10, 390, 290});
    return image;
  }

  // The message and its payload, as a receiver gets them.
  std::pair<PartialImage, Bytes> Lend(const LocalImage& image, PixelRange range) {
    PartialImage message = {.epoch = 1, .from_worker = 1, .key = kKey, .step = 4, .interval = {0, 1}, .pixels = range};
    std::optional<Bytes> payload = lent_.Lend(image, ViewOf(image, range, kFrame.width()), {2, "inproc://two", 7}, message);
    CHECK(payload.has_value());
    const AnyMessage received = Decode(Encode(message)).value();
    EXPECT_EQ(payload->size(), ExpectedPayloadBytes(received));
    return {std::get<PartialImage>(received), *payload};
  }

  Result<BorrowedImage> Borrow(const SharedImage& shared, const Bytes& payload, PixelRange range = kWhole) {
    return memory_.Borrow(shared, GetParam(), payload, range, kFrame, kNow);
  }

  Random random_{91};
  LentImages lent_;
  PeerMemory memory_;
};
INSTANTIATE_TEST_SUITE_P(All, SharedImagesTest, testing::Values(PixelFormat::kRgba, PixelFormat::kDepth),
                         [](const auto& format) { return format.param == PixelFormat::kRgba ? "Rgba" : "Depth"; });

TEST_P(SharedImagesTest, AreReadAsTheyAre) {
  const LocalImage image = Picture();
  for (const PixelRange range : {kWhole, PixelRange{0, 60000}, PixelRange{50123, 110007}}) {
    const auto [message, payload] = Lend(image, range);
    ASSERT_TRUE(memory_.Open(message.shared->arena, kNow).ok());
    const Result<BorrowedImage> borrowed = Borrow(*message.shared, payload, range);
    ASSERT_TRUE(borrowed.ok()) << borrowed.status().message();
    const RunImage read = EncodeRuns(borrowed->view), expected = EncodeRuns(image, range, kFrame.width());
    EXPECT_EQ(read.header, expected.header);
    EXPECT_EQ(read.payload, expected.payload);
    EXPECT_TRUE(borrowed->Intact());
    // Not more than the step was to move, whatever the spans say.
    const PixelRange less = {range.begin + 1000, range.end - 1000};
    const Result<BorrowedImage> part = Borrow(*message.shared, payload, less);
    ASSERT_TRUE(part.ok());
    EXPECT_EQ(EncodeRuns(part->view).payload, EncodeRuns(image, less, kFrame.width()).payload);
  }
  EXPECT_EQ(memory_.size(), 1U) << "one mapping for all";
  memory_.CloseIdle(kNow + PeerMemory::kIdle * 2);
  EXPECT_EQ(memory_.size(), 0U);
  const auto [late, spans] = Lend(image, kWhole);  // it has waited for longer than that
  EXPECT_TRUE(Borrow(*late.shared, spans).ok());
}

TEST_P(SharedImagesTest, StayWhatTheyWereUntilTheirGroupIsOver) {
  LocalImage image = Picture();
  const RunImage expected = EncodeRuns(image, kWhole, kFrame.width());
  const auto [message, payload] = Lend(image, kWhole);
  ASSERT_TRUE(memory_.Open(message.shared->arena, kNow).ok());
  image = {};                                        // the machine released it
  LocalImage next = Picture(), another = Picture();  // others are rendered
  {
    const Result<BorrowedImage> borrowed = Borrow(*message.shared, payload);
    ASSERT_TRUE(borrowed.ok());
    EXPECT_EQ(EncodeRuns(borrowed->view).payload, expected.payload);
    lent_.Forget([](const GroupKey& key) { return key != kKey; });
    EXPECT_TRUE(borrowed->Intact());
    EXPECT_GT(lent_.bytes(), 0U);
    // A reader that was stopped reads on while its group ends and the memory is used again.
    lent_.Forget([](const GroupKey& key) { return key == kKey; });
    EXPECT_EQ(lent_.bytes(), 0U);
    const LocalImage later = Picture();
    EXPECT_FALSE(borrowed->Intact());
  }
  EXPECT_EQ(Borrow(*message.shared, payload).status().code(), StatusCode::kDataLoss);
}

TEST_P(SharedImagesTest, SmallAndPrivateImagesAreNotLent) {
  const LocalImage small = RandomImage(random_, GetParam(), {0, 0, 20, 20});
  PartialImage message;
  EXPECT_FALSE(lent_.Lend(small, ViewOf(small), {}, message).has_value());
  EXPECT_FALSE(message.shared.has_value());
}

TEST_P(SharedImagesTest, WrongDescriptionsAreRefusedBeforeAnythingIsRead) {
  const LocalImage image = Picture();
  const auto [message, payload] = Lend(image, kWhole);
  ASSERT_TRUE(memory_.Open(message.shared->arena, kNow).ok());
  const auto refused = [&, good = *message.shared, spans = payload](const std::function<void(SharedImage&)>& change) {
    SharedImage shared = good;
    change(shared);
    return !Borrow(shared, spans).ok();
  };
  EXPECT_FALSE(refused([](SharedImage&) {}));
  EXPECT_TRUE(refused([](SharedImage& s) { s.arena.id ^= 1; }));
  EXPECT_TRUE(refused([](SharedImage& s) { s.bounds.x_end = 401; }));
  EXPECT_TRUE(refused([](SharedImage& s) { s.bounds.y_end += 1; }));
  EXPECT_TRUE(refused([](SharedImage& s) { s.bounds = {}; }));
  EXPECT_TRUE(refused([](SharedImage& s) { s.stride = 1; }));
  EXPECT_TRUE(refused([](SharedImage& s) { s.first_pixel = std::uint64_t{1} << 48; }));
  EXPECT_TRUE(refused([](SharedImage& s) { s.planes[0].offset = 0; }));
  EXPECT_TRUE(refused([](SharedImage& s) { s.planes[0].offset = kArenaBytes; }));
  EXPECT_TRUE(refused([](SharedImage& s) { s.planes[0].offset += 1; }));
  EXPECT_TRUE(refused([](SharedImage& s) { s.planes[0].generation += 1; }));
  EXPECT_TRUE(refused([](SharedImage& s) { s.planes[0].slot = kArenaSlots; }));
  EXPECT_TRUE(refused([](SharedImage& s) { s.planes.pop_back(); }));
  // Spans that leave the bounds, end before they begin, or are too few.
  std::vector<std::byte> spans(payload.span().begin(), payload.span().end());
  const auto with_span = [&](std::uint32_t begin, std::uint32_t end) {
    const ColumnSpan span = {begin, end};
    std::memcpy(spans.data() + 8 * 100, &span, sizeof(span));
    return Borrow(*message.shared, Bytes(std::vector<std::byte>(spans))).ok();
  };
  EXPECT_TRUE(with_span(0, 10));
  EXPECT_FALSE(with_span(0, 4000));
  EXPECT_FALSE(with_span(11, 10));
  EXPECT_FALSE(with_span(0xffffffffU, 0xffffffffU));
  spans.resize(spans.size() - 8);
  EXPECT_FALSE(Borrow(*message.shared, Bytes(std::move(spans))).ok());
}

TEST_P(SharedImagesTest, AnyNumbersAtAllAreNoCrash) {
  SCOPED_TRACE(random_.trace());
  const LocalImage image = Picture();
  const auto [message, payload] = Lend(image, kWhole);
  ASSERT_TRUE(memory_.Open(message.shared->arena, kNow).ok());
  const auto number = [&] {
    const std::uint64_t bits = random_.Integer<std::uint64_t>(0, ~std::uint64_t{0});
    return random_.Chance(0.5) ? bits >> random_.Integer(0, 63) : bits;
  };
  for (int i = 0; i < 5000; ++i) {
    SharedImage shared = *message.shared;
    const auto maybe = [&](auto& field) {
      if (random_.Chance(0.3)) field = std::remove_reference_t<decltype(field)>(number());
    };
    maybe(shared.stride);
    maybe(shared.first_pixel);
    shared.stride = std::min(shared.stride, 1U << 24);  // as the message was read
    shared.first_pixel = std::min(shared.first_pixel, std::uint64_t{1} << 48);
    for (BlockName& plane : shared.planes) {
      maybe(plane.offset);
      maybe(plane.slot);
    }
    const Result<BorrowedImage> borrowed = Borrow(shared, payload);
    if (borrowed.ok()) (void)CopyOf(borrowed->view);
  }
}

// ---- two executors, as in two workers

class TwoExecutors : public testing::Test {
 protected:
  TwoExecutors() { CHECK(ShareBlocks().ok()); }

  struct Worker {
    Outputs outputs;
    Executor executor{outputs.outbox, Codec::kRaw, 1};

    Status Combine(ImageHandle into, const PartialImage& message, const Bytes& payload, bool replace = false) {
      executor.Perform(StartCombine{.key = kKey,
                                    .image = into,
                                    .incoming = IncomingImage{message.image, message.shared, message.packed, payload},
                                    .side = Side::kBack,
                                    .replace = replace,
                                    .pixels = message.pixels,
                                    .frame = kFrame});
      return outputs.NextEvent<CombineDone>().status;
    }
    std::pair<PartialImage, Bytes> Send(ImageHandle image, bool lend) {
      executor.Perform(SendPartial{0,
                                   std::make_shared<Peer>(Peer{2, "inproc://two", 7}),
                                   {.epoch = 1, .from_worker = 1, .key = kKey, .step = 4, .interval = {0, 1}, .pixels = kWhole},
                                   image,
                                   kFrame,
                                   ColorCoding::kFloat32,
                                   0,
                                   {.lend = lend}});
      return TakeSent();
    }
    std::pair<PartialImage, Bytes> TakeSent() {
      const auto sent = std::get<OutgoingPartial>(outputs.Next());
      const AnyMessage message = Decode(sent.header).value();
      return {std::get<PartialImage>(message), sent.payload};
    }
  };

  // Gives a worker an image, as if it had come in frames.
  static void Give(Worker& worker, ImageHandle handle, const LocalImage& image) {
    RunImage runs = EncodeRuns(image, kWhole, kFrame.width());
    const PartialImage message = {.pixels = kWhole, .image = runs.header};
    ASSERT_TRUE(worker.Combine(handle, message, Bytes(std::move(runs.payload))).ok());
  }
  static PooledVector<std::byte> PixelsOf(Worker& worker, ImageHandle handle) {
    const auto [message, payload] = worker.Send(handle, false);
    return {payload.span().begin(), payload.span().end()};
  }

  Random random_{92};
  Worker one_, two_, three_;
};

TEST_F(TwoExecutors, LentImagesCombineAsSentOnesDo) {
  for (const PixelFormat format : {PixelFormat::kRgba, PixelFormat::kDepth}) {
    const LocalImage front = RandomImage(random_, format, {0, 0, 380, 280}), back = RandomImage(random_, format, {20, 30, 400, 300});
    const ImageHandle handle = format == PixelFormat::kRgba ? 1 : 2;
    for (Worker* worker : {&two_, &three_}) Give(*worker, handle, front);
    Give(one_, handle, back);
    const auto [lent, spans] = one_.Send(handle, true);
    ASSERT_TRUE(lent.shared.has_value());
    EXPECT_LT(spans.size(), 10000U);
    ASSERT_TRUE(two_.executor.peer_memory().Open(lent.shared->arena, kNow).ok());
    EXPECT_TRUE(two_.Combine(handle, lent, spans).ok());
    const auto [sent, runs] = one_.Send(handle, false);
    EXPECT_TRUE(three_.Combine(handle, sent, runs).ok());
    EXPECT_EQ(PixelsOf(two_, handle), PixelsOf(three_, handle));
    // And where pixels come back to where they were.
    EXPECT_TRUE(two_.Combine(handle, lent, spans, true).ok());
    EXPECT_EQ(PixelsOf(two_, handle), PixelsOf(one_, handle));
  }
}

// As those that come in frames.
TEST_F(TwoExecutors, PixelsThatAreNoneFailTheStep) {
  ImageHandle handle = 0;
  for (const PixelFormat format : {PixelFormat::kRgba, PixelFormat::kDepth}) {
    LocalImage image = RandomImage(random_, format, kFrame);
    const std::size_t pixel = 123 * 400 + 45;
    image.rgba[4 * pixel + 1] = std::numeric_limits<float>::quiet_NaN();
    if (format == PixelFormat::kDepth) image.depth[pixel] = -1e30F;  // in front of all others
    PartialImage message = {.epoch = 1, .from_worker = 1, .key = kKey, .step = 4, .interval = {0, 1}, .pixels = kWhole};
    LentImages lent;
    const std::optional<Bytes> spans = lent.Lend(image, ViewOf(image, kWhole, kFrame.width()), {2, "inproc://two", 7}, message);
    ASSERT_TRUE(spans.has_value());
    ASSERT_TRUE(two_.executor.peer_memory().Open(message.shared->arena, kNow).ok());
    const ImageHandle present = ++handle, fresh = ++handle;
    Give(two_, present, RandomImage(random_, format, {0, 0, 380, 280}));
    EXPECT_EQ(two_.Combine(present, message, *spans).code(), StatusCode::kInvalidArgument);
    EXPECT_EQ(two_.Combine(present, message, *spans, true).code(), StatusCode::kInvalidArgument);
    EXPECT_EQ(two_.Combine(fresh, message, *spans).code(), StatusCode::kInvalidArgument);
  }
}

TEST_F(TwoExecutors, WhatIsRefusedComesAsRuns) {
  Give(one_, 1, RandomImage(random_, PixelFormat::kRgba, {0, 0, 380, 280}));
  const PooledVector<std::byte> expected = PixelsOf(one_, 1);
  const auto [lent, spans] = one_.Send(1, true);
  ASSERT_TRUE(lent.shared.has_value());
  one_.executor.Perform(ReleaseImage{1});
  one_.executor.Perform(
      ResendImage{{.epoch = 1, .from_worker = 2, .key = lent.key, .step = lent.step + 1, .pixels = lent.pixels}});  // no such one
  one_.executor.Perform(ResendImage{{.epoch = 1, .from_worker = 2, .key = lent.key, .step = lent.step, .pixels = lent.pixels}});
  const auto [message, payload] = one_.TakeSent();
  EXPECT_FALSE(message.shared.has_value());
  EXPECT_EQ(message.step, lent.step);
  EXPECT_TRUE(std::ranges::equal(payload.span(), expected));
  one_.executor.Perform(ForgetGroups{.finished_before = kKey.frame + 1});
  one_.executor.Perform(
      ResendImage{{.epoch = 1, .from_worker = 2, .key = lent.key, .step = lent.step, .pixels = lent.pixels}});  // too late: nothing
}

TEST_F(TwoExecutors, AnImageThatWasTakenBackFailsTheStep) {
  Give(one_, 1, RandomImage(random_, PixelFormat::kRgba, kFrame));
  Give(two_, 1, RandomImage(random_, PixelFormat::kRgba, kFrame));
  const auto [lent, spans] = one_.Send(1, true);
  ASSERT_TRUE(two_.executor.peer_memory().Open(lent.shared->arena, kNow).ok());
  one_.executor.Perform(ReleaseImage{1});
  one_.executor.Perform(ForgetGroups{.finished_before = kKey.frame + 1});
  Give(one_, 2, RandomImage(random_, PixelFormat::kRgba, kFrame));  // its combining thread has let go of the image before this
  EXPECT_EQ(two_.Combine(1, lent, spans).code(), StatusCode::kDataLoss);
}

}  // namespace
}  // namespace slabstream
