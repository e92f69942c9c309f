// The worker machine and its voxels: what it asks for, keeps, copies and drops.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "common/planning/worker_memory.h"
#include "common/renderers/registry.h"
#include "common/renderers/renderer_kind.h"
#include "common/volume/light_volume.h"
#include "common/volume/memory_budget.h"
#include "tests/worker/worker_machine_fixture.h"

namespace slabstream {
namespace {

using testing::Le;
using testing::Not;

class WorkerBoxesTest : public WorkerMachineTest {
 public:
  static GroupAssignment Assigned(FrameId frame, std::uint32_t group) { return Assignment(frame, {kSelf}, group, 2); }
};

TEST_F(WorkerBoxesTest, AsksForChunksWithinItsCredit) {
  WorkerConfig config = Config();
  config.credit_bytes = 2 * kChunkBytes;
  Start(config);
  GroupAssignment assignment = Assignment(1, {kSelf});
  assignment.group.placements[0].box = {{0, 0, 0}, {128, 128, 320}};  // 328 slices with halo: 6 chunks, the last one short
  const auto first = All<SendChunkRequest>(Tell(assignment));
  ASSERT_THAT(first, SizeIs(2));
  EXPECT_EQ(first[0].request.chunk, 0U);
  EXPECT_EQ(first[1].request.chunk, 1U);
  EXPECT_EQ(first[0].request.box, (Box{{0, 0, 0}, {128, 128, 328}}));
  const Actions arrived = Tell(Answer(first[0].request));
  ASSERT_THAT(All<StoreChunk>(arrived), SizeIs(1));
  EXPECT_THAT(All<SendChunkRequest>(arrived), IsEmpty()) << "credit is used until the chunk is stored";
  EXPECT_THAT(All<StoreChunk>(Tell(Answer(first[0].request))), IsEmpty()) << "a second copy changes nothing";
  const StoreChunk store = All<StoreChunk>(arrived)[0];
  const auto next = All<SendChunkRequest>(Tell(ChunkStored{store.padded, store.chunk.box, 0, {}}));
  ASSERT_THAT(next, SizeIs(1));
  EXPECT_EQ(next[0].request.chunk, 2U);
}

TEST_F(WorkerBoxesTest, AsksAgainForWhatIsLostOrDamagedAndGivesUp) {
  WorkerConfig config = Config();
  config.chunk_attempts = 3;
  config.credit_bytes = kChunkBytes;
  Start(config);
  const auto first = All<SendChunkRequest>(Tell(Assignment(1, {kSelf})));
  ASSERT_THAT(first, SizeIs(1));
  Actions again = After(seconds(3));
  Tell(Ping{kEpoch, 0, {}});
  ASSERT_THAT(All<SendChunkRequest>(again), SizeIs(1));
  EXPECT_EQ(All<SendChunkRequest>(again)[0].request, first[0].request);
  const auto stored = All<StoreChunk>(Tell(Answer(first[0].request)));
  ASSERT_THAT(stored, SizeIs(1));
  again = Tell(ChunkStored{stored[0].padded, stored[0].chunk.box, 0, Status::DataLoss("digest")});
  ASSERT_THAT(All<SendChunkRequest>(again), SizeIs(1));
  const Actions given_up = After(seconds(3));
  const auto trouble = Sent<WorkerTrouble>(given_up);
  ASSERT_THAT(trouble, SizeIs(1));
  EXPECT_EQ(trouble[0].key, (GroupKey{1, 1, 0}));
  EXPECT_EQ(trouble[0].status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(All<DropBox>(given_up), SizeIs(1));
  EXPECT_THAT(All<OpenBox>(Tell(Assignment(1, {kSelf}, 0, 1, 2))), SizeIs(1)) << "the next attempt begins from nothing";
}

// How many chunks the cells of a box have is known when the first one comes.
TEST_F(WorkerBoxesTest, AsksForCellsAsTheirFirstChunkSays) {
  GroupAssignment assignment = Assignment(1, {kSelf});
  assignment.setup.cells = true;
  const auto first = All<SendChunkRequest>(Tell(assignment));
  ASSERT_THAT(first, SizeIs(3));
  EXPECT_EQ(first[2].request.chunk, kFirstCellChunk);
  EXPECT_EQ(first[2].request.box, first[0].request.box);
  const auto answer = [&](std::uint32_t chunk, std::uint64_t cell_bytes) {
    Chunk cells = Answer(first[0].request);
    cells.chunk = chunk;
    cells.cell_bytes = cell_bytes;
    cells.raw_bytes = BytesOfCellChunk(cell_bytes, chunk);
    return cells;
  };
  const auto store = [&](const Chunk& chunk) {
    const auto stores = All<StoreChunk>(Tell(chunk));
    EXPECT_THAT(stores, SizeIs(1));
    return Tell(ChunkStored{stores.at(0).padded, chunk.box, chunk.chunk, {}});
  };
  for (int chunk = 0; chunk < 2; ++chunk) {
    EXPECT_THAT(All<StartRender>(store(Answer(first[std::size_t(chunk)].request))), IsEmpty()) << "the cells are missing";
  }
  constexpr std::uint64_t kBytes = 2 * kChunkBytes + 9;
  const auto rest = All<SendChunkRequest>(store(answer(kFirstCellChunk, kBytes)));
  ASSERT_THAT(rest, SizeIs(2));
  EXPECT_EQ(rest[0].request.chunk, kFirstCellChunk + 1);
  EXPECT_EQ(rest[1].request.chunk, kFirstCellChunk + 2);
  EXPECT_THAT(All<StartRender>(store(answer(kFirstCellChunk + 2, kBytes))), IsEmpty());
  const auto again = All<SendChunkRequest>(Tell(answer(kFirstCellChunk + 1, kBytes + 1)));
  ASSERT_THAT(again, SizeIs(1)) << "a chunk of other cells is asked for again";
  EXPECT_THAT(All<StartRender>(store(answer(kFirstCellChunk + 1, kBytes))), SizeIs(1));
}

TEST_F(WorkerBoxesTest, FetchesTheCellsOfAResizedBoxAnew) {
  GroupAssignment assignment = Assignment(1, {kSelf});
  assignment.setup.cells = true;
  Rendered(All<StartRender>(Feed(Tell(assignment))).at(0));
  assignment.key.frame = 2;
  EXPECT_THAT(All<SendChunkRequest>(Tell(assignment)), IsEmpty()) << "they are kept";
  assignment.key.frame = 3;
  assignment.group.placements[0].box = {{0, 0, 10}, {100, 128, 80}};
  const Actions resized = Tell(assignment);
  ASSERT_THAT(All<OpenBox>(resized), SizeIs(1));
  EXPECT_THAT(All<OpenBox>(resized)[0].copies, IsEmpty());
  EXPECT_EQ(All<SendChunkRequest>(resized).back().request.chunk, kFirstCellChunk);
}

TEST_F(WorkerBoxesTest, ReportsARefusedChunk) {
  const auto requests = All<SendChunkRequest>(Tell(Assignment(1, {kSelf})));
  ASSERT_FALSE(requests.empty());
  const ChunkRequest& request = requests[0].request;
  const auto trouble =
      Sent<WorkerTrouble>(Tell(ChunkRefused{kEpoch, request.dataset, request.box, request.chunk, Status::NotFound("no such dataset")}));
  ASSERT_THAT(trouble, SizeIs(1));
  EXPECT_EQ(trouble[0].status, Status::NotFound("no such dataset"));
}

TEST_F(WorkerBoxesTest, KeepsBoxesForTheNextFrame) {
  const auto first = All<StartRender>(Feed(Tell(Assignment(1, {kSelf}))));
  ASSERT_THAT(first, SizeIs(1));
  const Actions done = Rendered(first[0]);
  ASSERT_THAT(Sent<GroupDone>(done), SizeIs(1));
  EXPECT_EQ(Sent<GroupDone>(done)[0].reports.at(0).voxel_bytes, 128U * 128 * 72);
  const Actions second = Tell(Assignment(2, {kSelf}));
  EXPECT_THAT(All<SendChunkRequest>(second), IsEmpty());
  ASSERT_THAT(All<StartRender>(second), SizeIs(1));
  EXPECT_EQ(Sent<GroupDone>(Rendered(All<StartRender>(second)[0]))[0].reports.at(0).voxel_bytes, 0U);
}

TEST_F(WorkerBoxesTest, ReportsAddUpWhatWasReadFromStores) {
  const auto requests = All<SendChunkRequest>(Tell(Assignment(1, {kSelf})));
  ASSERT_THAT(requests, SizeIs(2));
  Actions last;
  for (const SendChunkRequest& request : requests) {
    Chunk chunk = Answer(request.request);
    chunk.stored_bytes = 1000;
    const auto stores = All<StoreChunk>(Tell(chunk));
    ASSERT_THAT(stores, SizeIs(1));
    last = Tell(ChunkStored{stores[0].padded, chunk.box, chunk.chunk, {}});
  }
  ASSERT_THAT(All<StartRender>(last), SizeIs(1));
  EXPECT_EQ(Sent<GroupDone>(Rendered(All<StartRender>(last)[0])).at(0).reports.at(0).stored_bytes, 2000U);
  const Actions second = Tell(Assignment(2, {kSelf}));
  EXPECT_EQ(Sent<GroupDone>(Rendered(All<StartRender>(second).at(0)))[0].reports.at(0).stored_bytes, 0U) << "all was cached";
}

TEST_F(WorkerBoxesTest, ALargerHaloReplacesTheBoxOnceItIsCopied) {
  const auto first = All<StartRender>(Feed(Tell(Assignment(1, {kSelf}))));
  Rendered(first.at(0));
  GroupAssignment wider = Assignment(2, {kSelf});
  wider.setup.halo = 16;
  const Actions fed = Feed(Tell(wider));
  ASSERT_THAT(All<StartRender>(fed), SizeIs(1));
  EXPECT_THAT(All<DropBox>(fed), IsEmpty());
  EXPECT_THAT(All<DropBox>(Rendered(All<StartRender>(fed)[0])), ElementsAre(testing::Field(&DropBox::padded, first[0].padded)));
  const Actions narrow = Tell(Assignment(3, {kSelf}));
  EXPECT_THAT(All<SendChunkRequest>(narrow), IsEmpty()) << "the wider padded box holds all that the narrower halo needs";
  EXPECT_THAT(All<StartRender>(narrow), SizeIs(1));
}

TEST_F(WorkerBoxesTest, FetchesOfAResizedBoxWhatItDoesNotHold) {
  const auto first = All<StartRender>(Feed(Tell(Assignment(1, {kSelf})))).at(0);
  Rendered(first);
  GroupAssignment resized = Assignment(2, {kSelf});
  resized.group.placements[0].box = {{0, 0, 10}, {100, 128, 80}};
  const Actions told = Tell(resized);
  const auto open = All<OpenBox>(told);
  ASSERT_THAT(open, SizeIs(1));
  ASSERT_THAT(open[0].copies, SizeIs(1));
  EXPECT_EQ(open[0].copies[0].from, first.padded);
  EXPECT_EQ(open[0].copies[0].box, (Box{{0, 0, 2}, {108, 128, 72}})) << "as far as the padded box of 72 slices goes";
  const auto requests = All<SendChunkRequest>(told);
  ASSERT_THAT(requests, SizeIs(1));
  EXPECT_EQ(requests[0].request.box, (Box{{0, 0, 72}, {108, 128, 88}}));
  EXPECT_THAT(All<StartRender>(told), IsEmpty());
  const auto second = All<StartRender>(Feed(told));
  ASSERT_THAT(second, SizeIs(1));
  const Actions done = Rendered(second[0]);
  EXPECT_EQ(Sent<GroupDone>(done).at(0).reports.at(0).voxel_bytes, 108U * 128 * 16);

  // A part of both is all there.
  GroupAssignment within = Assignment(3, {kSelf});
  within.group.placements[0].box = {{8, 8, 30}, {120, 120, 64}};
  const Actions held = Tell(within);
  EXPECT_THAT(All<SendChunkRequest>(held), IsEmpty());
  EXPECT_THAT(All<StartRender>(held), SizeIs(1));
}

TEST_F(WorkerBoxesTest, FetchesAllWhereThereIsNoRoomForWhatItWouldCopyFrom) {
  WorkerConfig config = Config();
  config.cache_bytes = 128 * 128 * 150;
  Start(config);
  const auto first = All<StartRender>(Feed(Tell(Assignment(1, {kSelf})))).at(0);
  Rendered(first);
  GroupAssignment resized = Assignment(2, {kSelf});
  resized.group.placements[0].box = {{0, 0, 10}, {128, 128, 80}};
  const Actions told = Tell(resized);
  EXPECT_THAT(All<DropBox>(told), ElementsAre(testing::Field(&DropBox::padded, first.padded)));
  EXPECT_THAT(All<OpenBox>(told).at(0).copies, IsEmpty());
}

// Frames of volumes that do not fit: kParts boxes in as many groups, and a cache of kCached of them.
class FramesThatDoNotFitTest : public WorkerMachineTest {
 protected:
  static constexpr std::uint32_t kParts = 6, kCached = 3, kFetched = kParts - (kCached - 1);

  void SetUp() override {
    WorkerMachineTest::SetUp();
    WorkerConfig config = Config();
    config.cache_bytes = kCached * 128 * 128 * 80;
    Start(config);
  }

  // The parts of the dataset that were fetched for the client's next frame, which shows them from `first` on.
  std::vector<std::uint32_t> Fetched(ClientId client, DatasetId dataset, std::uint32_t parts = kParts, std::uint32_t first = 0) {
    ++frame_;
    std::vector<std::uint32_t> fetched;
    for (std::uint32_t group = 0; group < parts; ++group) {
      GroupAssignment part = Assignment(frame_, {kSelf}, group, parts);
      part.client = client;
      part.setup.dataset = dataset;
      part.setup.description.geometry.size = {128, 128, 64 * 2 * kParts};
      const auto z = std::int32_t(64 * (first + group));
      part.group.placements[0].box = {{0, 0, z}, {128, 128, z + 64}};
      const Actions told = Tell(part);
      if (!All<SendChunkRequest>(told).empty()) fetched.push_back(first + group);
      Rendered(All<StartRender>(Feed(told)).at(0));
    }
    return fetched;
  }

 private:
  FrameId frame_ = 0;
};

TEST_F(FramesThatDoNotFitTest, FindBoxesOfTheFrameBefore) {
  EXPECT_THAT(Fetched(1, 1), SizeIs(kParts));
  for (int frame = 0; frame < 10; ++frame) EXPECT_THAT(Fetched(1, 1), SizeIs(Le(kFetched))) << "one is in use, the others are found";
}

TEST_F(FramesThatDoNotFitTest, LeaveTheBoxesOfAnotherClientThatIsStillThere) {
  Fetched(1, 1);
  EXPECT_THAT(Fetched(2, 2, 1), ElementsAre(0));
  for (int frame = 0; frame < 5; ++frame) {
    Fetched(1, 1);
    EXPECT_THAT(Fetched(2, 2, 1), IsEmpty());
  }
}

TEST_F(FramesThatDoNotFitTest, TakeTheRoomOfBoxesThatNobodyNeedsAnyMore) {
  Fetched(1, 1);
  EXPECT_THAT(Fetched(1, 1, kCached - 1), IsEmpty());
  for (int frame = 0; frame < 2; ++frame) Fetched(1, 1, kCached - 1, kParts);  // the view has moved
  EXPECT_THAT(Fetched(1, 1, kCached - 1, kParts), IsEmpty());
  Fetched(2, 2);  // somebody else comes, and client 1 has gone
  Fetched(2, 2);
  EXPECT_THAT(Fetched(2, 2), SizeIs(Le(kFetched)));
}

// The first of two groups of a frame of `size`, or the second. Ray casting.
GroupAssignment Sized(FrameId frame, std::uint32_t group, ImageSize size) {
  GroupAssignment a = WorkerBoxesTest::Assigned(frame, group);
  SetRenderer(*FindRenderer("raycast"), a.setup);
  a.setup.sheets = {};
  a.setup.camera = MakeCamera({}, size, a.setup.description.geometry);
  return a;
}

std::uint64_t ImageBytesOf(const GroupAssignment& a) { return GroupImageBytes(a.setup, a.group.placements) + PictureBytes(a.setup); }

TEST_F(WorkerBoxesTest, BoxesTakeMemoryOneAfterTheOtherIfThereIsNoRoomForAll) {
  WorkerConfig config = Config();
  config.memory_bytes = kIdleMemoryBytes + 2 * ImageBytesOf(Sized(1, 0, {16, 16})) + 128 * 128 * 100;
  Start(config);
  const auto asked = All<SendChunkRequest>(Tell(Sized(1, 0, {16, 16})));
  ASSERT_THAT(asked, SizeIs(Not(0)));
  EXPECT_THAT(All<SendChunkRequest>(Tell(Sized(1, 1, {16, 16}))), IsEmpty()) << "the second group waits";
  std::vector<StartRender> renders;
  for (const SendChunkRequest& request : asked) {
    for (const StoreChunk& store : All<StoreChunk>(Tell(Answer(request.request)))) {
      const auto started = All<StartRender>(Tell(ChunkStored{store.padded, store.chunk.box, store.chunk.chunk, {}}));
      renders.insert(renders.end(), started.begin(), started.end());
    }
  }
  ASSERT_THAT(renders, SizeIs(1));
  const Actions after = Rendered(renders[0]);
  EXPECT_THAT(All<DropBox>(after), ElementsAre(testing::Field(&DropBox::padded, renders[0].padded)));
  EXPECT_THAT(All<StartRender>(Feed(after)), SizeIs(1));
}

// A worker stays under its limit: what images of frames need, cached voxels give up.
TEST_F(WorkerBoxesTest, ImagesOfFramesTakeRoomFromCachedVoxels) {
  constexpr std::uint64_t kBox = 128 * 128 * 80;
  const GroupAssignment large = Sized(2, 0, {512, 512});
  const std::uint64_t images = ImageBytesOf(large);
  ASSERT_GT(images, 2 * kBox);
  WorkerConfig config = Config();
  config.memory_bytes = kIdleMemoryBytes + images + kBox;
  Start(config);
  std::vector<BoxKey> cached;
  for (std::uint32_t group = 0; group < 2; ++group) {
    const auto render = All<StartRender>(Feed(Tell(Sized(1, group, {16, 16})))).at(0);
    cached.push_back(render.padded);
    EXPECT_THAT(All<DropBox>(Rendered(render)), IsEmpty());
  }
  EXPECT_THAT(All<DropBox>(Tell(large)), ElementsAre(testing::Field(&DropBox::padded, cached[1])))
      << "the one that the frame does not need";
}

// What the formula does not count, the process measures: caches of renderers, holes in its heaps, memory of other workers.
TEST_F(WorkerBoxesTest, WhatIsMeasuredBeyondTheLimitTakesRoomFromCachedVoxels) {
  std::int64_t spare = std::int64_t{1} << 30;
  WorkerConfig config = Config();
  config.memory_bytes = std::uint64_t{1} << 32;
  config.spare_for_images = [&spare] { return spare; };
  Start(config);
  for (std::uint32_t group = 0; group < 3; ++group) {
    const auto render = All<StartRender>(Feed(Tell(Sized(1, group, {16, 16})))).at(0);
    EXPECT_THAT(All<DropBox>(Rendered(render)), IsEmpty());
  }
  spare = -1;
  for (int look = 0; look < 2; ++look) {
    EXPECT_THAT(All<DropBox>(After(milliseconds(200))), SizeIs(1));
    EXPECT_THAT(All<DropBox>(Tell(Tick{})), IsEmpty()) << "memory comes back late; until the next look it is not missed again";
  }
  spare = 1 << 20;
  EXPECT_THAT(All<DropBox>(After(seconds(1))), IsEmpty());
  spare = -std::int64_t{1} << 30;
  EXPECT_THAT(All<DropBox>(After(seconds(1))), SizeIs(1));
  EXPECT_EQ(machine->sizes().boxes, 0U);
  EXPECT_THAT(All<StartRender>(Feed(Tell(Sized(2, 0, {16, 16})))), SizeIs(1)) << "a frame that is alone goes on";
}

TEST_F(WorkerBoxesTest, AnImageThatWaitsForOneInFrontOfItTakesRoomToo) {
  constexpr std::uint64_t kBox = 128 * 128 * 80;
  const GroupAssignment behind = Sized(1, 1, {4096, 4096});
  ASSERT_GT(GroupImageBytes(behind.setup, behind.group.placements), kBox);
  WorkerConfig config = Config();
  config.memory_bytes = kIdleMemoryBytes + ImageBytesOf(behind) + kBox + kBox / 2;
  Start(config);
  const auto render = All<StartRender>(Feed(Tell(behind))).at(0);
  EXPECT_THAT(All<DropBox>(Rendered(render)), IsEmpty()) << "the image in front of it is missing, so it waits";
  std::vector<BoxKey> dropped;
  const auto note = [&](const Actions& actions) {
    for (const DropBox& drop : All<DropBox>(actions)) dropped.push_back(drop.padded);
    return actions;
  };
  const Actions fed = note(Feed(Tell(Sized(2, 0, {16, 16}))));
  note(Rendered(All<StartRender>(fed).at(0)));
  EXPECT_THAT(dropped, ElementsAre(render.padded)) << "two boxes have no room beside it";
}

// What renderers derive from voxels grows and shrinks with the frames.
TEST_F(WorkerBoxesTest, CountsTheBytesThatTheLastFrameOfABoxReported) {
  constexpr std::uint64_t kVoxels = 128U * 128 * 72;
  FrameId frame = 0;
  const auto cached_after = [&](std::uint64_t box_bytes, const Status& status) {
    const StartRender render = All<StartRender>(Feed(Tell(Assignment(++frame, {kSelf})))).at(0);
    Tell(RenderDone{render.key, render.rank, render.image, status, {}, box_bytes});
    return Sent<Heartbeat>(After(seconds(2))).back().cached_bytes;
  };
  EXPECT_EQ(cached_after(5 * kVoxels, {}), 5 * kVoxels);
  EXPECT_EQ(cached_after(2 * kVoxels, {}), 2 * kVoxels);
  EXPECT_EQ(cached_after(kVoxels / 2, {}), kVoxels) << "bricks of one value take less, but any of them may be written";
  EXPECT_EQ(cached_after(3 * kVoxels, Status::Internal("render")), 3 * kVoxels) << "derived before the frame failed";
}

// A frame of several fields needs a box of each field beside its padded box.
class FieldBoxesTest : public WorkerBoxesTest {
 public:
  // Dataset 2 on the volume's grid; dataset 3 of 32-bit floats, whose voxels have twice the volume's spacing.
  static GroupAssignment OfFields(FrameId frame) {
    GroupAssignment a = Assignment(frame, {kSelf});
    a.setup.fields.push_back({.levels = {{2, a.setup.description, {}}}, .of_volume = {0}, .look = {}});
    VolumeDescription coarse = a.setup.description;
    coarse.type = ScalarType::kFloat32;
    coarse.geometry.size = {64, 64, 320};
    coarse.geometry.spacing = {2, 2, 2};
    a.setup.fields.push_back({.levels = {{3, coarse, {}}}, .of_volume = {0}, .look = {}});
    return a;
  }
  static Chunk AnswerOf(const SendChunkRequest& sent) {
    Chunk chunk = Answer(sent.request);
    chunk.raw_bytes = PartOfChunk(sent.request.box, sent.padded.types.samples, sent.request.chunk).bytes;
    return chunk;
  }
};

TEST_F(FieldBoxesTest, ARenderBeginsOnceTheBoxesOfAllFieldsAreThere) {
  WorkerConfig config = Config();
  config.credit_bytes = std::uint64_t{1} << 30;
  Start(config);
  const auto assignment = OfFields(1);
  const auto requests = All<SendChunkRequest>(Tell(assignment));
  std::map<DatasetId, Box> asked;
  for (const SendChunkRequest& request : requests) asked[request.request.dataset] = request.request.box;
  EXPECT_EQ(asked[1], (Box{{0, 0, 0}, {128, 128, 72}}));
  EXPECT_EQ(asked[2], asked[1]);
  EXPECT_EQ(asked[3], PaddedBox(assignment.group.placements[0].at(), assignment.setup, assignment.setup.fields[1]));
  std::vector<StartRender> renders;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    EXPECT_THAT(renders, IsEmpty()) << "before chunk " << i << " of " << requests.size();
    for (const StoreChunk& store : All<StoreChunk>(Tell(AnswerOf(requests[i])))) {
      renders = All<StartRender>(Tell(ChunkStored{store.padded, store.chunk.box, store.chunk.chunk, {}}));
    }
  }
  ASSERT_THAT(renders, SizeIs(1));
  const StartRender& render = renders[0];
  EXPECT_EQ(render.padded.dataset, 1U);
  ASSERT_THAT(render.fields, SizeIs(2));
  EXPECT_EQ(render.fields.at(0)->dataset, 2U);
  EXPECT_EQ(render.fields.at(1)->dataset, 3U);
  EXPECT_EQ(render.fields.at(1)->types.samples, ScalarType::kFloat32);

  constexpr std::uint64_t kVoxels = 128U * 128 * 72;
  const std::uint64_t coarse = 4 * std::uint64_t(asked[3].voxel_count());
  Tell(RenderDone{render.key, render.rank, render.image, {}, {}, kVoxels, {3 * kVoxels, coarse}});
  EXPECT_EQ(Sent<Heartbeat>(After(seconds(2))).back().cached_bytes, 4 * kVoxels + coarse) << "with what was derived of a field";
  EXPECT_THAT(All<SendChunkRequest>(Tell(OfFields(2))), IsEmpty()) << "they are kept";
}

// Also that of a field that does not reach the box: it may shade what is there.
TEST_F(FieldBoxesTest, ARenderHasTheLightVolumesOfAllFields) {
  GroupAssignment assignment = OfFields(1);
  FrameSetup& setup = assignment.setup;
  setup.fields[1] = setup.fields[0];
  setup.fields[1].levels[0].description.geometry.orientation.origin = {0, 0, 300};
  const auto light = [](DatasetId dataset, VolumeDescription of) {
    of.geometry = LightGeometry(of.geometry);
    return CoarserLevel{LightVolumeOf(dataset), of};
  };
  setup.shading.shadows = 1;
  setup.light = light(1, setup.description);
  setup.fields[0].light = light(2, setup.description);
  setup.fields[1].light = light(3, setup.fields[1].levels[0].description);
  const auto renders = All<StartRender>(Feed(Tell(assignment)));
  ASSERT_THAT(renders, SizeIs(1));
  ASSERT_THAT(renders[0].lights, SizeIs(3));
  for (DatasetId i = 0; i < 3; ++i) {
    EXPECT_EQ(renders[0].lights[i].dataset, LightVolumeOf(i + 1));
    EXPECT_EQ(renders[0].lights[i].box, LightVolumesOf(setup)[i]->description.geometry.bounds());
  }
}

TEST_F(FieldBoxesTest, AFieldThatDoesNotReachABoxIsNotAskedFor) {
  GroupAssignment assignment = OfFields(1);
  assignment.setup.fields[1].levels[0].description.geometry.orientation.origin = {0, 0, 300};
  std::vector<DatasetId> opened;
  for (const OpenBox& open : All<OpenBox>(Tell(assignment))) opened.push_back(open.padded.dataset);
  EXPECT_THAT(opened, testing::UnorderedElementsAre(1, 2));
}

TEST_F(FieldBoxesTest, AFieldWhoseVoxelsDoNotComeFailsTheGroup) {
  WorkerConfig config = Config();
  config.chunk_attempts = 1;
  Start(config);
  Actions fed = Tell(OfFields(1));
  std::vector<WorkerTrouble> troubles;
  for (std::size_t i = 0; i < fed.size() && troubles.empty(); ++i) {
    Actions more;
    if (const auto* sent = std::get_if<SendChunkRequest>(&fed[i])) {
      more = sent->request.dataset == 3
                 ? Tell(ChunkRefused{kEpoch, 3, sent->request.box, sent->request.chunk, Status::DataLoss("bad block")})
                 : Tell(AnswerOf(*sent));
    } else if (const auto* store = std::get_if<StoreChunk>(&fed[i])) {
      more = Tell(ChunkStored{store->padded, store->chunk.box, store->chunk.chunk, {}});
    }
    troubles = Sent<WorkerTrouble>(more);
    fed.insert(fed.end(), more.begin(), more.end());
  }
  ASSERT_THAT(troubles, SizeIs(1));
  EXPECT_EQ(troubles[0].key, (GroupKey{1, 1, 0}));
  EXPECT_THAT(troubles[0].status.message(), testing::HasSubstr("bad block"));
  EXPECT_EQ(machine->sizes().renders, 0U);
}

TEST_F(FieldBoxesTest, OneBoxMayServeTwoFields) {
  GroupAssignment assignment = OfFields(1);
  assignment.setup.fields[1] = assignment.setup.fields[0];
  const auto render = All<StartRender>(Feed(Tell(assignment))).at(0);
  EXPECT_EQ(render.fields.at(0), render.fields.at(1));
  Rendered(render);
  EXPECT_EQ(machine->sizes().renders, 0U);
  assignment.key.frame = 2;
  EXPECT_THAT(All<StartRender>(Tell(assignment)), SizeIs(1));
}

// A render needs all of its boxes at once: they may take more room than there is.
TEST_F(FieldBoxesTest, TheNextRenderGetsAllOfItsBoxes) {
  WorkerConfig config = Config();
  config.memory_bytes = kIdleMemoryBytes + 128 * 128 * 100;
  Start(config);
  GroupAssignment assignment = Sized(1, 0, {16, 16});
  assignment.setup.fields = {OfFields(1).setup.fields[0]};
  EXPECT_THAT(All<StartRender>(Feed(Tell(assignment))), SizeIs(1));
}

TEST_F(WorkerBoxesTest, VoxelsStayWhenTheCoordinatorStartsAnew) {
  const auto first = All<StartRender>(Feed(Tell(Assignment(1, {kSelf})))).at(0);
  Rendered(first);
  for (const Epoch epoch : {kEpoch, kEpoch + 1}) {
    Tell(Retire{epoch});
    EXPECT_THAT(All<DropBox>(Tell(WelcomeTo(1001 + epoch - kEpoch, epoch))), IsEmpty());
  }
  GroupAssignment again = Assignment(1, {kSelf});
  again.epoch = kEpoch + 1;
  const Actions actions = Tell(again);
  EXPECT_THAT(All<SendChunkRequest>(actions), IsEmpty());
  EXPECT_EQ(All<StartRender>(actions).at(0).padded, first.padded);

  again.key.frame = 2;
  ++again.setup.dataset;
  EXPECT_THAT(All<SendChunkRequest>(Tell(again)), testing::Not(IsEmpty())) << "another volume";
}

// ---------------------------------------------------------------- voxels that are read where they are stored

// The camera shows the whole volume: what lies outside a picture is not read.
void StoreAt(const StoredAt& stored, GroupAssignment& assignment) {
  assignment.setup.stored = stored;
  assignment.setup.sheets = {};
  assignment.setup.camera = MakeCamera({}, {16, 16}, assignment.setup.description.geometry);
}

TEST_F(WorkerBoxesTest, AsksForStoredVoxelsInPiecesThatEndAtBlocks) {
  const StoredAt stored{.source = "/data/scan.ome.zarr", .version = 5, .block = {{0, 0, 0}, {128, 128, 24}}};
  GroupAssignment assignment = Assignment(1, {kSelf});
  StoreAt(stored, assignment);
  assignment.group.placements[0].box = {{0, 0, 100}, {128, 128, 340}};
  const auto requests = All<SendChunkRequest>(Tell(assignment));
  const Box padded = {{0, 0, 92}, {128, 128, 348}};
  std::int64_t voxels = 0;
  std::int32_t z = padded.begin.z;
  for (const SendChunkRequest& request : requests) {
    ASSERT_NE(request.stored, nullptr);
    EXPECT_EQ(*request.stored, stored);
    const Box& box = request.request.box;
    EXPECT_EQ(box.begin.z, z) << "in order, and none twice";
    EXPECT_TRUE(box.end.z % 24 == 0 || box.end.z == padded.end.z) << box.end.z;
    EXPECT_LE(box.voxel_count(), kChunkBytes);
    z = box.end.z;
    voxels += box.voxel_count();
  }
  EXPECT_EQ(voxels, padded.voxel_count());
  EXPECT_GT(requests.size(), 1U);
}

TEST_F(WorkerBoxesTest, AsksForPartsOfLargeBlocksEachOfWhichIsOneChunk) {
  GroupAssignment assignment = Assignment(1, {kSelf});
  StoreAt(StoredAt{.source = "/data/scan.ome.zarr", .block = {{0, 0, 0}, {128, 128, 512}}}, assignment);
  assignment.group.placements[0].box = {{0, 0, 100}, {128, 128, 340}};
  std::int64_t voxels = 0;
  for (const SendChunkRequest& request : All<SendChunkRequest>(Tell(assignment))) {
    EXPECT_EQ(request.request.chunk, 0U);
    EXPECT_LE(request.request.box.voxel_count(), kChunkBytes);
    voxels += request.request.box.voxel_count();
  }
  EXPECT_EQ(voxels, 128 * 128 * 256);
}

TEST_F(WorkerBoxesTest, VoxelsThatItReadsItselfNeedNoChunk) {
  GroupAssignment assignment = Assignment(1, {kSelf});
  StoreAt(StoredAt{.source = "/data/scan.ome.zarr", .block = {{0, 0, 0}, {128, 128, 64}}}, assignment);
  assignment.group.placements[0].box = {{0, 0, 64}, {128, 120, 128}};
  const Actions told = Tell(assignment);
  EXPECT_TRUE(All<OpenBox>(told).at(0).stored);
  Actions last;
  for (const SendChunkRequest& request : All<SendChunkRequest>(told)) {
    EXPECT_THAT(All<StartRender>(last), IsEmpty());
    last = Tell(ChunkStored{request.padded, request.request.box, request.request.chunk, {}});
    EXPECT_THAT(All<StoreChunk>(last), IsEmpty());
  }
  EXPECT_THAT(All<StartRender>(last), SizeIs(1));
}

TEST_F(WorkerBoxesTest, AsksForSmallBlocksTogether) {
  GroupAssignment assignment = Assignment(1, {kSelf});
  StoreAt(StoredAt{.source = "/data/scan.nrrd", .block = {{0, 0, 0}, {128, 1, 1}}}, assignment);
  assignment.group.placements[0].box = {{0, 0, 100}, {128, 128, 340}};  // 4 MiB
  EXPECT_LE(All<SendChunkRequest>(Tell(assignment)).size(), 6U) << "a request for every row would be slow";
}

TEST_F(WorkerBoxesTest, TwoBoxesThatWantTheSamePieceBothGetIt) {
  GroupAssignment assignment = Assignment(1, {kSelf, kSelf});
  StoreAt(StoredAt{.source = "/data/scan.ome.zarr", .block = {{0, 0, 0}, {128, 128, 64}}}, assignment);
  assignment.group.placements[0].box = {{0, 0, 64}, {128, 120, 128}};
  assignment.group.placements[1].box = {{0, 0, 64}, {128, 120, 129}};  // each with a halo: the pieces up to voxel 128 are the same
  const Actions asked = Tell(assignment);
  std::map<Box, int> wanted;
  for (const SendChunkRequest& request : All<SendChunkRequest>(asked)) ++wanted[request.request.box];
  EXPECT_THAT(wanted, testing::Contains(testing::Pair(testing::_, 2)));
  const auto first = All<StartRender>(Feed(asked));
  ASSERT_THAT(first, SizeIs(1)) << "one at a time";
  EXPECT_THAT(All<StartRender>(Rendered(first[0])), SizeIs(1)) << "the other one needs no more voxels";
}

TEST_F(WorkerBoxesTest, AsksForNoStoredVoxelsOutsideThePicture) {
  GroupAssignment assignment = Assignment(1, {kSelf});
  StoreAt(StoredAt{.source = "/data/scan.nrrd", .block = {{0, 0, 0}, {128, 1, 1}}}, assignment);
  assignment.setup.camera = MakeCamera({.zoom = 100}, {16, 16}, assignment.setup.description.geometry);
  assignment.group.placements[0].box = {{0, 0, 0}, {8, 8, 8}};
  EXPECT_THAT(All<SendChunkRequest>(Tell(assignment)), IsEmpty());
}

// ---------------------------------------------------------------- voxels that need not be read

class FilledBoxesTest : public WorkerBoxesTest {
 protected:
  // Blocks of 32 voxels a side; a padded box of 128 x 128 x 72 voxels.
  static GroupAssignment Stored(FrameId frame, std::vector<FilledBox> filled) {
    GroupAssignment assignment = Assignment(frame, {kSelf});
    assignment.setup.stored = StoredAt{.source = "/data/scan.ome.zarr", .block = {{0, 0, 0}, {32, 32, 32}}};
    assignment.group.placements[0].filled = std::move(filled);
    return assignment;
  }
  static std::int64_t Asked(const Actions& actions) {  // voxels
    std::int64_t voxels = 0;
    for (const SendChunkRequest& send : All<SendChunkRequest>(actions)) voxels += send.request.box.voxel_count();
    return voxels;
  }
  // Answers and renders; what was asked for.
  std::vector<Box> Draw(const GroupAssignment& assignment) {
    std::vector<Box> asked;
    Actions actions = Tell(assignment), others;
    opened_ = All<OpenBox>(actions);
    for (std::size_t i = 0; i < actions.size(); ++i) {
      Actions more;
      if (const auto* request = std::get_if<SendChunkRequest>(&actions[i])) {
        asked.push_back(request->request.box);
        more = Tell(Answer(request->request));
      } else if (const auto* store = std::get_if<StoreChunk>(&actions[i])) {
        more = Tell(ChunkStored{store->padded, store->chunk.box, store->chunk.chunk, {}});
      }
      actions.insert(actions.end(), more.begin(), more.end());
    }
    EXPECT_THAT(All<StartRender>(actions), SizeIs(1));
    Rendered(All<StartRender>(actions).at(0));
    return asked;
  }
  static std::int64_t Voxels(const std::vector<Box>& boxes) {
    std::int64_t voxels = 0;
    for (const Box& box : boxes) voxels += box.voxel_count();
    return voxels;
  }

  static constexpr Box kPadded = {{0, 0, 0}, {128, 128, 72}};
  static constexpr FilledBox kLeft = {{{0, 0, 0}, {32, 128, 64}}, 5}, kRight = {{{96, 0, 0}, {128, 128, 64}}, 7};
  std::vector<OpenBox> opened_;
};

TEST_F(FilledBoxesTest, AreNotAskedFor) {
  const std::vector<Box> asked = Draw(Stored(1, {kLeft, kRight}));
  EXPECT_EQ(Voxels(asked), kPadded.voxel_count() - kLeft.box.voxel_count() - kRight.box.voxel_count());
  for (const Box& box : asked) {
    EXPECT_TRUE(Intersection(box, kLeft.box).empty());
    EXPECT_TRUE(Intersection(box, kRight.box).empty());
  }
  ASSERT_THAT(opened_, SizeIs(1));
  EXPECT_THAT(opened_[0].filled, ElementsAre(kLeft, kRight));
  EXPECT_THAT(Draw(Stored(2, {kLeft, kRight})), IsEmpty()) << "the box is kept";
}

TEST_F(FilledBoxesTest, AreReadOnceSomethingShowsThem) {
  Draw(Stored(1, {kLeft, kRight}));
  const std::vector<Box> asked = Draw(Stored(2, {kRight}));
  EXPECT_EQ(Voxels(asked), kLeft.box.voxel_count()) << "the rest is copied";
  for (const Box& box : asked) EXPECT_TRUE(kLeft.box.Contains(box));
  ASSERT_THAT(opened_, SizeIs(1));
  std::int64_t copied = 0;
  for (const OpenBox::Copy& copy : opened_[0].copies) {
    EXPECT_TRUE(Intersection(copy.box, kLeft.box).empty());
    EXPECT_TRUE(Intersection(copy.box, kRight.box).empty()) << "what was never read is no copy's source";
    copied += copy.box.voxel_count();
  }
  EXPECT_EQ(copied, kPadded.voxel_count() - kLeft.box.voxel_count() - kRight.box.voxel_count());
  EXPECT_THAT(Draw(Stored(3, {kLeft, kRight})), IsEmpty()) << "a box that has more will do";
  EXPECT_EQ(Voxels(Draw(Stored(4, {}))), kRight.box.voxel_count());
}

TEST_F(FilledBoxesTest, WhatLiesOutsideThePaddedBoxDoesNotMatter) {
  Draw(Stored(1, {{{{0, 0, 0}, {32, 128, 640}}, 5}}));
  ASSERT_THAT(opened_, SizeIs(1));
  ASSERT_THAT(opened_[0].filled, SizeIs(1));
  EXPECT_EQ(opened_[0].filled[0].box, (Box{{0, 0, 0}, {32, 128, 72}}));
}

}  // namespace
}  // namespace slabstream
