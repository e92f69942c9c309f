// The executor against orders as the machine gives them: every order that has an answer gets exactly one, also when what came in is
// damaged.
#include "worker/service/executor.h"
#include "tests/support/renderers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <semaphore>

#include "common/kernels/combine.h"
#include "common/mesh/mesh_part.h"
#include "common/mesh/summarize_cells.h"
#include "common/wire/payload.h"
#include "tests/common/mesh/mesh_samples.h"
#include "tests/service/outputs.h"
#include "tests/service/pictures.h"
#include "tests/support/same_image.h"
#include "worker/renderers/for_each_piece.h"
#include "worker/service/stored_box.h"

namespace slabstream {
namespace {

constexpr PixelBounds kFrame = {0, 0, 16, 8};
constexpr GroupKey kKey = {.frame = 3, .attempt = 1, .group = 0};

LocalImage Filled(const PixelBounds& bounds, float value) {
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, bounds);
  std::fill(image.rgba.begin(), image.rgba.end(), value);
  return image;
}

class ExecutorTest : public testing::Test {
 protected:
  // Orders a combine of an image as it comes from another worker.
  CombineDone CombineIncoming(ImageHandle into, const LocalImage& image, Side side) {
    RunImage runs = EncodeRuns(image, {0, 16 * 8}, 16);
    executor_.Perform(StartCombine{.key = kKey,
                                   .image = into,
                                   .incoming = IncomingImage{.header = runs.header, .payload = Bytes(std::move(runs.payload))},
                                   .side = side,
                                   .frame = kFrame});
    return outputs_.NextEvent<CombineDone>();
  }
  // What the image would be sent as: its pixels.
  LocalImage PixelsOf(ImageHandle image, PixelRange pixels = {0, 16 * 8}, const PixelBounds& frame = kFrame) {
    executor_.Perform(
        SendPartial{.to = std::make_shared<Peer>(),
                    .message = {.epoch = 1, .from_worker = 1, .key = kKey, .interval = {0, 1}, .pixels = pixels, .reports = {RankReport{}}},
                    .image = image,
                    .frame = frame});
    const auto sent = std::get<OutgoingPartial>(outputs_.Next());
    const AnyMessage message = Decode(sent.header).value();
    const auto& partial = std::get<PartialImage>(message);
    EXPECT_EQ(partial.reports.back().image_bytes, sent.payload.size());
    return *ReadRuns(partial.image, sent.payload.span(), partial.image.bounds);
  }

  // The box of all of the volume, whose voxels are stored. They fit a chunk.
  BoxKey StoredBoxOf(const std::shared_ptr<const Volume>& volume) {
    const BoxKey padded{.dataset = 1, .box = volume->block.box, .types = volume->block.type, .generation = 1};
    executor_.Perform(OpenBox{padded, {}});
    Chunk chunk{.epoch = 1, .dataset = 1, .box = padded.box, .chunk = 0};
    const Bytes payload = PackChunk(Bytes(volume, volume->block.bytes), Codec::kRaw, chunk);
    executor_.Perform(StoreChunk{padded, chunk, payload});
    EXPECT_TRUE(outputs_.NextEvent<ChunkStored>().status.ok());
    return padded;
  }

  Outputs outputs_;
  Executor executor_{outputs_.outbox, Codec::kZstd, 2};
};

TEST_F(ExecutorTest, ImagesCombineInOrderAndSourcesStayAsTheyAre) {
  EXPECT_TRUE(CombineIncoming(1, Filled({0, 0, 8, 4}, 0.5F), Side::kBack).status.ok());
  EXPECT_TRUE(CombineIncoming(2, Filled({0, 0, 4, 4}, 0.25F), Side::kBack).status.ok());
  // 3 becomes a copy of the left half of row 0 of 1; then 2 goes behind 1.
  executor_.Perform(StartCombine{.key = kKey, .image = 3, .other = 1, .pixels = {0, 4}, .frame = kFrame});
  EXPECT_TRUE(outputs_.NextEvent<CombineDone>().status.ok());
  executor_.Perform(StartCombine{.key = kKey, .image = 1, .other = 2, .side = Side::kBack, .frame = kFrame});
  EXPECT_TRUE(outputs_.NextEvent<CombineDone>().status.ok());

  const LocalImage combined = PixelsOf(1);
  EXPECT_FLOAT_EQ(PixelAt(combined, 1, 1).rgba[3], 0.5F + 0.5F * 0.25F);
  EXPECT_FLOAT_EQ(PixelAt(combined, 6, 1).rgba[3], 0.5F);
  const LocalImage part = PixelsOf(3);
  EXPECT_FLOAT_EQ(PixelAt(part, 3, 0).rgba[3], 0.5F);
  EXPECT_FLOAT_EQ(PixelAt(part, 4, 0).rgba[3], 0.0F);
  EXPECT_FLOAT_EQ(PixelAt(part, 0, 1).rgba[3], 0.0F);
  EXPECT_FLOAT_EQ(PixelAt(PixelsOf(2), 1, 1).rgba[3], 0.25F);
}

TEST_F(ExecutorTest, SharesOfALargeFrameBecomeOneImage) {
  constexpr PixelBounds kLarge = {0, 0, 4099, 1100};  // so large that images do not get room for all of it at once
  constexpr auto kPixels = std::uint64_t(kLarge.pixel_count());
  constexpr std::uint64_t kShares = 7;  // which begin within rows
  const LocalImage front = Filled({100, 50, 300, 900}, 0.5F), back = Filled({250, 0, 320, 1100}, 0.25F);
  const auto share = [](std::uint64_t i) { return PixelRange{i * kPixels / kShares, (i + 1) * kPixels / kShares}; };
  for (std::uint64_t i = 0; i < kShares; ++i) {
    for (const LocalImage* image : {&front, &back}) {
      RunImage runs = EncodeRuns(*image, share(i), kLarge.width());
      executor_.Perform(StartCombine{.key = kKey,
                                     .image = 1 + i,
                                     .incoming = IncomingImage{.header = runs.header, .payload = Bytes(std::move(runs.payload))},
                                     .side = Side::kBack,
                                     .pixels = share(i),
                                     .frame = kLarge});
      EXPECT_TRUE(outputs_.NextEvent<CombineDone>().status.ok());
    }
  }
  for (std::uint64_t i = 1; i < kShares; ++i) {
    executor_.Perform(StartCombine{.key = kKey, .image = 1, .other = 1 + i, .side = Side::kBack, .pixels = share(i), .frame = kLarge});
    EXPECT_TRUE(outputs_.NextEvent<CombineDone>().status.ok());
  }
  LocalImage expected = front;
  Combine(expected, back, Side::kBack);
  ExpectSameBits(PixelsOf(1, {0, kPixels}, kLarge), expected);
}

// In strips, say: the report goes with the last one.
TEST_F(ExecutorTest, ReportsTellOfAllMessagesOfTheirRank) {
  ASSERT_TRUE(CombineIncoming(1, Filled({0, 0, 8, 4}, 0.5F), Side::kBack).status.ok());
  const auto send = [&](Rank rank, PixelRange pixels, std::vector<RankReport> reports) {
    executor_.Perform(SendPartial{
        .to = std::make_shared<Peer>(),
        .message = {.epoch = 1, .from_worker = 1, .key = kKey, .interval = {0, 1}, .pixels = pixels, .reports = std::move(reports)},
        .image = 1,
        .frame = kFrame,
        .rank = rank});
    return std::get<OutgoingPartial>(outputs_.Next());
  };
  const std::size_t bytes = send(3, {0, 16}, {}).payload.size() + send(3, {16, 32}, {}).payload.size();
  EXPECT_GT(bytes, 0U);
  const std::size_t others = send(4, {0, 16}, {}).payload.size();
  const OutgoingPartial last = send(3, {32, 128}, {{.rank = 2}, {.rank = 3}});
  const AnyMessage message = Decode(last.header).value();
  const std::vector<RankReport>& reports = std::get<PartialImage>(message).reports;
  EXPECT_EQ(reports[0], RankReport{.rank = 2}) << "not of this worker";
  EXPECT_EQ(reports[1].image_bytes, bytes + last.payload.size());
  EXPECT_EQ(reports[1].spans.size(), 3U);

  // With GroupDone, if no message carries them.
  std::vector<RankReport> done = {{.rank = 3}, {.rank = 4}};
  executor_.AddSent(kKey, done);
  EXPECT_EQ(done[0], RankReport{.rank = 3}) << "told already";
  EXPECT_EQ(done[1].image_bytes, others);
}

TEST_F(ExecutorTest, ReleasedImagesServeTheOrdersThatWereGivenBefore) {
  EXPECT_TRUE(CombineIncoming(1, Filled({0, 0, 8, 4}, 0.5F), Side::kBack).status.ok());
  executor_.Perform(StartCombine{.key = kKey, .image = 2, .other = 1, .frame = kFrame});
  executor_.Perform(ReleaseImage{1});
  EXPECT_TRUE(outputs_.NextEvent<CombineDone>().status.ok());
  EXPECT_FLOAT_EQ(PixelAt(PixelsOf(2), 7, 3).rgba[3], 0.5F);
  executor_.Perform(ReleaseImage{1});  // again: nothing happens
}

TEST_F(ExecutorTest, DamagedRunsAreRefused) {
  EXPECT_TRUE(CombineIncoming(1, Filled({0, 0, 8, 4}, 0.5F), Side::kBack).status.ok());
  // Where a colour is found wrong, part of the image may have been combined: another image than the one looked at below.
  EXPECT_TRUE(CombineIncoming(2, Filled({0, 0, 8, 4}, 0.5F), Side::kBack).status.ok());
  EXPECT_EQ(CombineIncoming(2, Filled({0, 0, 8, 4}, NAN), Side::kBack).status.code(), StatusCode::kInvalidArgument);
  RunImage runs = EncodeRuns(Filled({0, 0, 8, 4}, 0.5F), {0, 16 * 8}, 16);
  runs.header.bounds = {0, 0, 1 << 24, 1 << 24};  // would take petabytes
  executor_.Perform(StartCombine{.key = kKey,
                                 .image = 1,
                                 .incoming = IncomingImage{.header = runs.header, .payload = Bytes(std::move(runs.payload))},
                                 .frame = kFrame});
  EXPECT_FALSE(outputs_.NextEvent<CombineDone>().status.ok());
  EXPECT_FALSE(CombineIncoming(1, MakeLocalImage(PixelFormat::kDepth, {0, 0, 8, 4}), Side::kBack).status.ok());
  EXPECT_FLOAT_EQ(PixelAt(PixelsOf(1), 7, 3).rgba[3], 0.5F) << "the image is as it was";
}

TEST_F(ExecutorTest, HiddenTilesAreThoseOfWhatWasCombinedBefore) {
  FrameSetup setup;
  setup.sheets.width = 40;  // 5 x 1 tiles
  setup.sheets.height = 8;
  const auto shared = std::make_shared<const FrameSetup>(setup);
  const PixelBounds frame = FrameBounds(setup);
  const auto combine = [&](const PixelBounds& bounds, float alpha) {
    RunImage runs = EncodeRuns(Filled(bounds, alpha), WholeFrame(setup), frame.width());
    executor_.Perform(StartCombine{.key = kKey,
                                   .image = 1,
                                   .incoming = IncomingImage{.header = runs.header, .payload = Bytes(std::move(runs.payload))},
                                   .frame = frame});
  };
  combine({0, 0, 20, 8}, 1);
  executor_.Perform(FindHidden{0, kKey, 1, shared, {}});
  combine({30, 0, 40, 8}, 1);
  executor_.Perform(FindHidden{0, kKey, 1, shared, {}});
  EXPECT_TRUE(outputs_.NextEvent<CombineDone>().status.ok());
  const auto first = outputs_.NextEvent<HiddenFound>();
  EXPECT_EQ(first.image, 1U);
  EXPECT_EQ(first.key, kKey);
  EXPECT_EQ(first.hidden, (OcclusionMask{5, 1, {kOcclusionSteps, kOcclusionSteps, 0, 0, 0}}));
  EXPECT_TRUE(outputs_.NextEvent<CombineDone>().status.ok());
  EXPECT_EQ(outputs_.NextEvent<HiddenFound>().hidden, (OcclusionMask{5, 1, {kOcclusionSteps, kOcclusionSteps, 0, 0, kOcclusionSteps}}));
}

TEST_F(ExecutorTest, AnImageWithDepthHidesNothing) {
  EXPECT_TRUE(CombineIncoming(1, MakeLocalImage(PixelFormat::kDepth, {0, 0, 8, 4}), Side::kBack).status.ok());
  executor_.Perform(FindHidden{0, kKey, 1, std::make_shared<const FrameSetup>(), {}});
  EXPECT_TRUE(outputs_.NextEvent<HiddenFound>().hidden.empty());
}

TEST_F(ExecutorTest, FinishedFrameIsResolvedAndPacked) {
  EXPECT_TRUE(CombineIncoming(1, Filled({2, 0, 8, 4}, 0.5F), Side::kBack).status.ok());
  FrameSetup setup;
  SetRenderer(*ZBuffer(), setup);
  setup.camera.supersample = 2;
  executor_.Perform(SendFrame{.message = {.epoch = 1, .worker = 1, .frame = 3, .attempt = 1, .groups_done = 1},
                              .image = 1,
                              .pixels = WholeFrame(setup),
                              .setup = std::make_shared<const FrameSetup>(setup)});
  const auto sent = std::get<OutgoingFrame>(outputs_.Next());
  const FrameImage& frame = sent.message;
  EXPECT_EQ(frame.picture.runs.image.bounds, (PixelBounds{1, 0, 4, 2}));
  ASSERT_EQ(frame.reports.size(), 1U);
  EXPECT_GT(frame.reports[0].stage_ns[std::size_t(Stage::kEncode)], 0);
  const Result<Bytes> runs = UnpackRuns(frame.picture.runs, sent.payload);
  ASSERT_TRUE(runs.ok()) << runs.status().message();
  EXPECT_FLOAT_EQ(PixelAt(*ReadRuns(frame.picture.runs.image, runs->span(), frame.picture.runs.image.bounds), 3, 1).rgba[3], 0.5F);
}

TEST_F(ExecutorTest, EveryChunkIsAnsweredAndDamageIsFound) {
  const BoxKey padded{.dataset = 4, .box = {{0, 0, 0}, {10, 10, 5}}, .types = ScalarType::kUint16};
  Chunk chunk{.epoch = 1, .dataset = 4, .box = padded.box, .chunk = 0};
  const Bytes payload = PackChunk(Bytes(std::vector<std::byte>(1000, std::byte{7})), Codec::kZstd, chunk);
  const auto store = [&](const Chunk& header, const Bytes& bytes) {
    executor_.Perform(StoreChunk{padded, header, bytes});
    const auto stored = outputs_.NextEvent<ChunkStored>();
    EXPECT_EQ(stored.padded, padded);
    EXPECT_EQ(stored.chunk, header.chunk);
    return stored.status.code();
  };
  EXPECT_EQ(store(chunk, payload), StatusCode::kNotFound) << "no such padded box yet";
  executor_.Perform(OpenBox{padded});
  Chunk damaged = chunk;
  damaged.digest ^= 1;
  EXPECT_EQ(store(damaged, payload), StatusCode::kDataLoss);
  damaged = chunk;
  damaged.chunk = 1;
  EXPECT_EQ(store(damaged, payload), StatusCode::kDataLoss);
  damaged = chunk;
  damaged.box.end.z = 6;
  EXPECT_EQ(store(damaged, payload), StatusCode::kDataLoss);
  EXPECT_EQ(store(chunk, payload), StatusCode::kOk);
  EXPECT_EQ(store(chunk, payload), StatusCode::kOk) << "a duplicate changes nothing";
  executor_.Perform(DropBox{padded});
  EXPECT_EQ(store(chunk, payload), StatusCode::kNotFound);
}

TEST_F(ExecutorTest, RenderIsAnsweredAlsoWhenItIsCancelled) {
  const std::shared_ptr<const Volume> volume = TestSphere(96);
  FrameRequest request = TestRequest(Splatting(), 20);
  request.size = {1024, 1024};
  const FramePlan plan = PlanFrame(request, 1, Summarize(*volume), Roster{{1}}).value();
  const BoxKey padded{.dataset = 1, .box = volume->block.box, .types = volume->block.type};
  executor_.Perform(OpenBox{padded});
  const Bytes samples(volume, volume->block.bytes);
  ASSERT_LE(samples.size(), kChunkBytes);
  Chunk chunk{.epoch = 1, .dataset = 1, .box = padded.box, .chunk = 0};
  const Bytes payload = PackChunk(samples, Codec::kRaw, chunk);
  executor_.Perform(StoreChunk{padded, chunk, payload});
  ASSERT_TRUE(outputs_.NextEvent<ChunkStored>().status.ok());

  const auto setup = std::make_shared<const FrameSetup>(plan.setup);
  executor_.Perform(StartRender{.key = kKey, .padded = padded, .placement = {.box = padded.box, .worker = 1}, .setup = setup, .image = 1});
  executor_.Perform(CancelRender{1});
  auto done = outputs_.NextEvent<RenderDone>();
  EXPECT_EQ(done.image, 1U);
  EXPECT_TRUE(done.status.ok() || done.status.code() == StatusCode::kCancelled) << done.status.message();

  executor_.Perform(DropBox{padded});  // but its last render goes on
  executor_.Perform(OpenBox{padded});
  executor_.Perform(StoreChunk{padded, chunk, payload});
  ASSERT_TRUE(outputs_.NextEvent<ChunkStored>().status.ok());
  executor_.Perform(StartRender{.key = kKey, .padded = padded, .placement = {.box = padded.box, .worker = 1}, .setup = setup, .image = 2});
  executor_.Perform(DropBox{padded});
  done = outputs_.NextEvent<RenderDone>();
  EXPECT_TRUE(done.status.ok()) << done.status.message();
  EXPECT_GT(done.box_bytes, 0U);
  EXPECT_GT(done.report.stage_ns[std::size_t(Stage::kRender)], 0);
}

TEST(StoredBoxTest, VoxelsThatTheProcessHoldsAreReadWhereTheyLie) {
  auto volume = std::make_shared<Volume>();
  volume->description.geometry.size = {40, 20, 10};
  volume->block = MakeVoxelBlock(volume->description.geometry.bounds(), ScalarType::kUint8);
  for (std::size_t i = 0; i < volume->block.bytes.size(); ++i) volume->block.bytes[i] = std::byte(i % 251);
  const BoxKey key{.dataset = 1, .box = {{3, 2, 1}, {30, 20, 9}}, .types = ScalarType::kUint8};
  StoredBox box(key, {}, false);
  auto held = std::make_shared<const HeldVoxels>(HeldVoxels{std::shared_ptr<const Volume>(volume)});
  const std::weak_ptr<const HeldVoxels> kept = held;
  box.Hold(std::move(held));
  EXPECT_FALSE(box.Assemble()) << "nothing is copied";
  EXPECT_FALSE(kept.expired()) << "the box keeps the voxels";
  EXPECT_EQ(box.bytes(), 0U) << "they are not its own";
  {
    const StoredBox::Lease lease = box.Lend(1);
    const VoxelBricks bricks = lease.data().bricks();
    EXPECT_EQ(bricks.box(), key.box);
    const BrickView<std::uint8_t> view = bricks.View<std::uint8_t>({0, 0, 0});
    EXPECT_EQ(view.Row(2, 1), volume->block.samples<std::uint8_t>() + volume->block.Offset({3, 2, 1}));
    EXPECT_EQ(lease.data().voxels().bytes, CutBlock(volume->block, key.box).bytes);
  }
  EXPECT_TRUE(kept.expired()) << "a block of its own has taken their place";
}

TEST(StoredBoxTest, WhatIsFilledHasItsSampleAndSoHasThePaddingBesideIt) {
  const Box whole = {{0, 0, 0}, {40, 20, 10}}, read = {{8, 0, 0}, {32, 20, 10}};
  const BoxKey key{.dataset = 1, .box = whole, .types = ScalarType::kUint16};
  StoredBox box(key, {}, true, {{{{0, 0, 0}, {8, 20, 10}}, 0}, {{{32, 0, 0}, {40, 20, 10}}, 300}});
  constexpr std::uint16_t kRead = 0x0909;
  Chunk chunk{.epoch = 1, .dataset = 1, .box = read, .chunk = 0};
  std::vector<std::byte> samples(std::size_t(read.voxel_count()) * sizeof(kRead), std::byte{9});
  const Bytes payload = PackChunk(Bytes(std::move(samples)), Codec::kRaw, chunk);
  ASSERT_TRUE(box.Store(chunk, payload).ok());
  EXPECT_FALSE(box.Assemble()) << "nothing is copied";
  const StoredBox::Lease lease = box.Lend(1);
  ASSERT_NE(lease.data().padded(), nullptr);
  for (const std::int32_t y : {-2, 0, 19, 21}) {
    for (std::int32_t x = -kPad; x < whole.end.x + kPad; ++x) {
      std::uint16_t sample = 0;
      std::memcpy(&sample, lease.data().padded()->At({x, y, 5}), sizeof(sample));
      EXPECT_EQ(sample, x < 8 ? 0 : x < 32 ? kRead : 300) << x << ", " << y;
    }
  }
}

// Renders small frames at once. Larger ones have three pieces, each of which says that it has begun and then waits until it may end.
class StepwiseRenderer : public Renderer {
 public:
  struct Steps {
    std::counting_semaphore<> begun{0}, may_end{0};
  };
  explicit StepwiseRenderer(Steps& steps) : steps_(steps) {}

  Result<LocalImage> Render(BoxData&, const LevelBox&, const FrameSetup& setup, const OcclusionMask&, const RenderControl& control,
                            RankReport&) override {
    if (FrameBounds(setup).pixel_count() >= 64 * 64) {
      ForEachPiece(3, control, [this](std::int32_t) {
        steps_.begun.release();
        steps_.may_end.acquire();
      });
    }
    if (control.cancelled()) return Status::Cancelled("rendering was cancelled");
    return MakeLocalImage(setup.format, {});
  }

 private:
  Steps& steps_;
};

TEST(ExecutorPauses, ARenderThatPausesLetsThatOfAnotherClientPass) {
  StepwiseRenderer::Steps steps;
  Outputs outputs;
  Executor executor(outputs.outbox, Codec::kRaw, 1, [&](const RendererKind&) { return std::make_unique<StepwiseRenderer>(steps); });
  const std::shared_ptr<const Volume> volume = TestSphere(8);
  const auto start = [&](ClientId client, std::int32_t size, ImageHandle image) {
    const BoxKey padded{.dataset = 1, .box = volume->block.box, .types = volume->block.type, .generation = image};
    executor.Perform(OpenBox{padded});
    Chunk chunk{.epoch = 1, .dataset = 1, .box = padded.box, .chunk = 0};
    const Bytes payload = PackChunk(Bytes(volume, volume->block.bytes), Codec::kRaw, chunk);
    executor.Perform(StoreChunk{padded, chunk, payload});
    ASSERT_TRUE(outputs.NextEvent<ChunkStored>().status.ok());
    FrameRequest request = TestRequest(FindRenderer("mip"), 20);
    request.size = {size, size};
    const auto setup = std::make_shared<const FrameSetup>(PlanFrame(request, 1, Summarize(*volume), Roster{{1}}).value().setup);
    executor.Perform(StartRender{
        .client = client, .key = kKey, .padded = padded, .placement = {.box = padded.box, .worker = 1}, .setup = setup, .image = image});
  };
  start(1, 64, 1);
  steps.begun.acquire();
  executor.Perform(PauseRender{1});
  steps.may_end.release(3);
  for (ImageHandle small = 2; small < 5; ++small) {
    start(2, 1, small);
    EXPECT_EQ(outputs.NextEvent<RenderDone>().image, small) << "the other one goes on";
  }
  EXPECT_FALSE(steps.begun.try_acquire()) << "a piece begins in a pause";
  executor.Perform(ResumeRender{1});
  const RenderDone done = outputs.NextEvent<RenderDone>();
  EXPECT_EQ(done.image, 1U);
  EXPECT_TRUE(done.status.ok()) << done.status.message();

  start(1, 64, 5);
  executor.Perform(PauseRender{5});
  executor.Perform(CancelRender{5});
  steps.may_end.release(3);
  EXPECT_EQ(outputs.NextEvent<RenderDone>().status.code(), StatusCode::kCancelled) << "a render that pauses can be cancelled";
}

// Two transfer functions, so that each derives something else from the voxels.
TEST_F(ExecutorTest, RendersOfTwoClientsFromOneBoxAreAsEachAlone) {
  const std::shared_ptr<const Volume> volume = TestSphere(24);
  for (const RendererKind* renderer : Renderers()) {
    if (renderer->Can(Ability::kCells)) continue;
    SCOPED_TRACE(renderer->name());
    std::array<std::shared_ptr<const FrameSetup>, 2> setups;
    for (int client = 0; client < 2; ++client) {
      FrameRequest request = TestRequest(renderer, 40);
      request.view.azimuth_degrees = 30 + 80 * client;
      request.transfer.choice = TransferFunction{.colors = {{0, {0, 0, 0}}, {255, {1, 1, 1}}},
                                                 .opacities = {{0, 0}, {60.0 + 90 * client, 0}, {61.0 + 90 * client, 1}, {255, 1}}};
      setups.at(std::size_t(client)) =
          std::make_shared<const FrameSetup>(PlanFrame(request, 1, Summarize(*volume), Roster{{1}}).value().setup);
    }
    const BoxKey padded = StoredBoxOf(volume);

    ImageHandle image = 0;
    const auto start = [&](ClientId client) {
      executor_.Perform(StartRender{.client = client,
                                    .key = kKey,
                                    .padded = padded,
                                    .placement = {.box = padded.box, .worker = 1},
                                    .setup = setups.at(client),
                                    .image = ++image});
    };
    const auto pixels_of = [&](ImageHandle rendered) {
      const PixelBounds frame = FrameBounds(*setups[0]);
      return PixelsOf(rendered, {0, std::uint64_t(frame.pixel_count())}, frame);
    };
    std::vector<LocalImage> alone;
    for (const ClientId client : {0, 1}) {
      start(client);
      ASSERT_TRUE(outputs_.NextEvent<RenderDone>().status.ok());
      alone.push_back(pixels_of(image));
      EXPECT_FALSE(alone.back().bounds.empty());
    }
    for (int round = 0; round < 8; ++round) {
      start(0);
      start(1);
      for (int each = 0; each < 2; ++each) ASSERT_TRUE(outputs_.NextEvent<RenderDone>().status.ok());
      for (const ClientId client : {0, 1}) {
        ExpectSameBits(pixels_of(image - 1 + client), alone[client]);
      }
    }
    for (; image > 0; --image) executor_.Perform(ReleaseImage{image});
    executor_.Perform(DropBox{padded});
  }
}

// Several fields of a frame may have the same box, and one may not reach there.
TEST_F(ExecutorTest, ARenderReadsTheBoxOfEachFieldThatItShows) {
  const std::shared_ptr<const Volume> volume = TestSphere(24);
  FrameSetup alone = PlanFrame(TestRequest(FindRenderer("raycast"), 40), 1, Summarize(*volume), Roster{{1}}).value().setup, several = alone;
  const FieldSetup field = {
      .levels = {{1, alone.description, {}}}, .of_volume = {0}, .look = {.transfer = alone.transfer, .range = alone.range}};
  several.fields = {field, field, field};
  const BoxKey padded = StoredBoxOf(volume);
  const PixelBounds frame = FrameBounds(alone);
  const auto rendered = [&](ImageHandle image, const FrameSetup& setup, std::vector<std::optional<BoxKey>> fields) {
    const auto fields_shown = std::size_t(std::ranges::count_if(fields, [](const auto& of) { return of.has_value(); }));
    executor_.Perform(StartRender{.key = kKey,
                                  .padded = padded,
                                  .placement = {.box = padded.box, .worker = 1},
                                  .setup = std::make_shared<const FrameSetup>(setup),
                                  .image = image,
                                  .fields = std::move(fields)});
    const auto done = outputs_.NextEvent<RenderDone>();
    EXPECT_TRUE(done.status.ok()) << done.status.message();
    EXPECT_EQ(done.field_bytes.size(), setup.fields.size());
    for (std::size_t i = 0; i < fields_shown; ++i) EXPECT_GE(done.field_bytes.at(i), volume->block.bytes.size());
    return PixelsOf(image, {0, std::uint64_t(frame.pixel_count())}, frame);
  };
  const LocalImage one = rendered(1, alone, {}), three = rendered(2, several, {padded, padded, std::nullopt});
  ExpectSameBits(rendered(3, several, {padded, padded, std::nullopt}), three);
  ExpectSameBits(rendered(4, alone, {}), one);
  const auto opacity = [](const LocalImage& image) {
    double sum = 0;
    for (std::size_t i = 3; i < image.rgba.size(); i += 4) sum += double(image.rgba[i]);
    return sum;
  };
  EXPECT_GT(opacity(one), 0);
  EXPECT_GT(opacity(three), 1.05 * opacity(one));
}

TEST_F(ExecutorTest, WhatIsCopiedFromOtherBoxesIsWhatWouldHaveArrived) {
  const auto volume = std::make_shared<const Volume>(AsGrid(*TestSphere(60), 6));
  const Box whole = volume->block.box;
  for (const RendererKind* renderer : Renderers()) {
    const FramePlan plan = PlanFrame(TestRequest(renderer, 20), 1, SummaryOf(*volume), Roster{{1}}).value();
    const auto setup = std::make_shared<const FrameSetup>(plan.setup);
    const auto store = [&](const BoxKey& padded, const Box& box) {
      Chunk chunk{.epoch = 1, .dataset = 1, .box = box, .chunk = 0};
      const VoxelBlock samples = CutBlock(volume->block, box);
      ASSERT_LE(samples.bytes.size(), kChunkBytes);
      const Bytes payload = PackChunk(Bytes(std::vector<std::byte>(samples.bytes.begin(), samples.bytes.end())), Codec::kRaw, chunk);
      executor_.Perform(StoreChunk{padded, chunk, payload});
      const auto stored = outputs_.NextEvent<ChunkStored>();
      EXPECT_TRUE(stored.status.ok()) << stored.status.message();
      EXPECT_EQ(stored.box, box);
    };
    // Cells are not copied: each padded box that is rendered from gets its own.
    const auto store_cells = [&](const BoxKey& padded) {
      std::vector<std::byte> cells = EncodeMesh(MeshCutter(volume->cells).Cut(padded.box));
      ASSERT_LE(cells.size(), kChunkBytes);
      Chunk chunk{.epoch = 1, .dataset = 1, .box = padded.box, .chunk = kFirstCellChunk, .cell_bytes = cells.size()};
      const Bytes payload = PackChunk(Bytes(std::move(cells)), Codec::kRaw, chunk);
      executor_.Perform(StoreChunk{padded, chunk, payload});
      const auto stored = outputs_.NextEvent<ChunkStored>();
      EXPECT_TRUE(stored.status.ok()) << stored.status.message();
    };
    const auto render = [&](const BoxKey& padded, ImageHandle image) {
      executor_.Perform(
          StartRender{.key = kKey, .padded = padded, .placement = {.box = whole, .worker = 1}, .setup = setup, .image = image});
      const auto done = outputs_.NextEvent<RenderDone>();
      EXPECT_TRUE(done.status.ok()) << done.status.message();
      return done.report;
    };
    const auto key = [&](const Box& box, std::uint64_t generation) {
      return BoxKey{.dataset = 1, .box = box, .types = {volume->block.type, plan.setup.cells}, .generation = generation};
    };
    const BoxKey direct = key(whole, 1), lower = key({{0, 0, 0}, {60, 60, 30}}, 2), side = key({{20, 0, 0}, {60, 60, 50}}, 3),
                 put_together = key(whole, 4);
    executor_.Perform(OpenBox{direct, {}});
    store(direct, whole);
    store_cells(direct);
    const RankReport expected = render(direct, 1);
    EXPECT_GT(expected.image_pixels, 0U);

    for (const bool stored : {false, true}) {  // voxels that are read in parts are stored in another way
      // One source is itself a copy in part and was not rendered from; both are dropped before the first render.
      executor_.Perform(OpenBox{lower, {}, stored});
      store(lower, lower.box);
      executor_.Perform(OpenBox{side, {{lower, {{20, 0, 0}, {60, 60, 30}}}}, stored});
      store(side, {{20, 0, 30}, {60, 60, 50}});
      executor_.Perform(OpenBox{put_together, {{lower, lower.box}, {side, {{20, 0, 30}, {60, 60, 50}}}}, stored});
      store(put_together, {{0, 0, 30}, {20, 60, 50}});
      store(put_together, {{0, 0, 50}, {60, 60, 60}});
      store_cells(put_together);
      executor_.Perform(DropBox{lower});
      executor_.Perform(DropBox{side});
      const RankReport report = render(put_together, 2);
      EXPECT_EQ(report.occupied_voxels, expected.occupied_voxels);
      EXPECT_EQ(report.drawn_voxels, expected.drawn_voxels);
      EXPECT_EQ(report.image_bounds, expected.image_bounds);
      EXPECT_EQ(report.image_pixels, expected.image_pixels);
      for (const ImageHandle image : {1, 2}) executor_.Perform(ReleaseImage{image});
      executor_.Perform(DropBox{put_together});
    }
    executor_.Perform(DropBox{direct});
  }
}

}  // namespace
}  // namespace slabstream
