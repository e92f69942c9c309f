// The worker machine by scripted events: what it does about each, in each state.
#include "worker/worker_machine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <vector>

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

constexpr Epoch kEpoch = 77;
constexpr WorkerId kSelf = 3, kPeer = 4;
using Actions = std::vector<WorkerAction>;

template <class T>
std::vector<T> All(const Actions& actions) {
  std::vector<T> found;
  for (const WorkerAction& action : actions) {
    if (const T* match = std::get_if<T>(&action)) found.push_back(*match);
  }
  return found;
}

template <class T>
std::vector<T> Sent(const Actions& actions) {
  std::vector<T> found;
  for (const SendControl& send : All<SendControl>(actions)) {
    if (const T* match = std::get_if<T>(&send.message)) found.push_back(*match);
  }
  return found;
}

// A machine and its time, registered unless the test says otherwise.
class WorkerMachineTest : public testing::Test {
 protected:
  static WorkerConfig Config() {
    WorkerConfig config;
    config.incarnation = 1000;
    config.host = "here";
    config.images_endpoint = "inproc://self";
    return config;
  }

  void SetUp() override { Start(Config()); }

  void Start(const WorkerConfig& config, bool registered = true) {
    machine.emplace(config);
    if (!registered) return;
    Tell(Tick{});
    Tell(WelcomeTo(config.incarnation));
    ASSERT_TRUE(machine->registered());
  }

  static Welcome WelcomeTo(Incarnation incarnation, Epoch epoch = kEpoch, WorkerId worker = kSelf) {
    return {epoch, incarnation, worker, "inproc://slabs", 500, 6000};
  }

  Actions Tell(const WorkerEvent& event) { return machine->Step(event, now); }
  Actions Tell(const AnyMessage& message, Bytes payload = {}) { return Tell(WorkerEvent(MessageReceived{message, std::move(payload)})); }
  Actions After(Duration time) {
    now += time;
    return Tell(Tick{});
  }

  // One group of a frame of 4 x 2 pixels: rank r shows box r, which is one MiB and a bit with its halo. Nothing is ever hidden.
  static GroupAssignment Assignment(FrameId frame, std::vector<WorkerId> placements, std::uint32_t group = 0, std::uint32_t group_count = 1,
                                    std::uint32_t attempt = 1) {
    GroupAssignment a;
    a.epoch = kEpoch;
    a.key = {frame, attempt, group};
    a.group_count = group_count;
    a.display = kSelf;
    a.setup.dataset = 1;
    a.setup.description.geometry.size = {128, 128, 640};
    a.setup.sheets.width = 4;
    a.setup.sheets.height = 2;
    a.setup.termination = 0;
    for (Rank rank = 0; rank < placements.size(); ++rank) {
      const std::int32_t slab = std::int32_t(group * 4 + rank);
      a.group.placements.push_back({BoxId(slab), {{0, 0, slab * 64}, {128, 128, slab * 64 + 64}}, placements[rank]});
    }
    if (!placements.empty()) a.group.schedule = MakeFanIn({Rank(placements.size()), 0, {0, 8}});
    a.peers = {{kSelf, "inproc://self"}, {kPeer, "inproc://peer"}};
    return a;
  }

  static PartialImage FromPeer(const GroupKey& key) {  // rank 1 to rank 0
    PartialImage partial;
    partial.epoch = kEpoch;
    partial.from_worker = kPeer;
    partial.key = key;
    partial.interval = {1, 2};
    partial.pixels = {0, 8};
    partial.reports.resize(1);
    partial.reports[0].rank = 1;
    partial.reports[0].worker = kPeer;
    return partial;
  }

  static Chunk Answer(const ChunkRequest& request) {
    Chunk chunk;
    chunk.epoch = kEpoch;
    chunk.dataset = request.dataset;
    chunk.box = request.box;
    chunk.chunk = request.chunk;
    const auto total = std::uint64_t(request.box.voxel_count());
    chunk.raw_bytes = std::uint32_t(std::min<std::uint64_t>(kChunkBytes, total - std::uint64_t(request.chunk) * kChunkBytes));
    return chunk;
  }

  // Answers chunk requests until there are none; returns everything else that was done.
  Actions Feed(Actions actions) {
    Actions others;
    for (std::size_t i = 0; i < actions.size(); ++i) {
      Actions more;
      if (const auto* request = std::get_if<SendChunkRequest>(&actions[i])) {
        more = Tell(Answer(request->request));
      } else if (const auto* store = std::get_if<StoreChunk>(&actions[i])) {
        more = Tell(ChunkStored{store->slab, store->chunk.box, store->chunk.chunk, {}});
      } else {
        others.push_back(actions[i]);
      }
      actions.insert(actions.end(), more.begin(), more.end());
    }
    return others;
  }

  Actions Rendered(const StartRender& render, Status status = {}) {
    return Tell(RenderDone{render.key, render.rank, render.image, std::move(status), {}, 0});
  }
  Actions Combined(const StartCombine& combine, Status status = {}) {
    return Tell(CombineDone{combine.key, combine.image, std::move(status), {}});
  }

  std::optional<WorkerMachine> machine;
  Time now{seconds(100)};
};

// ---------------------------------------------------------------- registration

TEST_F(WorkerMachineTest, RegistersUntilWelcome) {
  Start(Config(), false);
  EXPECT_THAT(Sent<Register>(Tell(Tick{})), SizeIs(1));
  EXPECT_THAT(Sent<Register>(After(milliseconds(10))), IsEmpty());
  EXPECT_EQ(machine->NextWake(), now + milliseconds(990));
  const auto again = Sent<Register>(After(milliseconds(990)));
  ASSERT_THAT(again, SizeIs(1));
  EXPECT_EQ(again[0].incarnation, 1000U);
  EXPECT_EQ(again[0].images_endpoint, "inproc://self");

  EXPECT_THAT(Tell(WelcomeTo(999)), IsEmpty()) << "a welcome to somebody else";
  const Actions welcomed = Tell(WelcomeTo(1000));
  EXPECT_EQ(machine->worker(), kSelf);
  ASSERT_THAT(All<ConnectSlabs>(welcomed), SizeIs(1));
  EXPECT_EQ(All<ConnectSlabs>(welcomed)[0].endpoint, "inproc://slabs");
  EXPECT_THAT(Sent<Heartbeat>(welcomed), SizeIs(1));
  EXPECT_THAT(Tell(WelcomeTo(1000)), IsEmpty()) << "a second copy changes nothing";
}

TEST_F(WorkerMachineTest, BeatsAndFallsSilentWithItsCoordinator) {
  EXPECT_THAT(Sent<Heartbeat>(After(milliseconds(500))), SizeIs(1));
  Tell(Ping{kEpoch, 0, {}});
  After(milliseconds(5900));
  EXPECT_TRUE(machine->registered());
  Tell(Ping{kEpoch + 1, 0, {}});  // of another coordinator: not a sign of life of this one
  const auto registers = Sent<Register>(After(milliseconds(100)));
  EXPECT_FALSE(machine->registered());
  ASSERT_THAT(registers, SizeIs(1));
  EXPECT_EQ(registers[0].incarnation, 1001U) << "what it held is gone, so it is a new worker";
  EXPECT_THAT(Tell(WelcomeTo(1000)), IsEmpty());
  EXPECT_FALSE(Tell(WelcomeTo(1001)).empty());
  EXPECT_TRUE(machine->registered());
}

TEST_F(WorkerMachineTest, RetireMakesItRegisterAgain) {
  EXPECT_THAT(Sent<Register>(Tell(Retire{kEpoch + 1})), SizeIs(1));
  EXPECT_FALSE(machine->registered());
  EXPECT_THAT(Tell(Retire{kEpoch + 1}), IsEmpty());
}

TEST_F(WorkerMachineTest, LeavesInOrderAndObeysStop) {
  const Actions leaving = Tell(StopRequested{});
  EXPECT_THAT(Sent<Leave>(leaving), SizeIs(1));
  EXPECT_THAT(All<StopProcess>(leaving), SizeIs(1));
  EXPECT_EQ(machine->NextWake(), Time::max());
  EXPECT_THAT(After(seconds(10)), IsEmpty());

  Start(Config());
  EXPECT_THAT(All<StopProcess>(Tell(Stop{kEpoch + 1})), IsEmpty()) << "another coordinator's";
  EXPECT_THAT(All<StopProcess>(Tell(Stop{kEpoch})), SizeIs(1));
}

// ---------------------------------------------------------------- voxels

TEST_F(WorkerMachineTest, AsksForChunksWithinItsCredit) {
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
  const auto next = All<SendChunkRequest>(Tell(ChunkStored{store.slab, store.chunk.box, 0, {}}));
  ASSERT_THAT(next, SizeIs(1));
  EXPECT_EQ(next[0].request.chunk, 2U);
}

TEST_F(WorkerMachineTest, AsksAgainForWhatIsLostOrDamagedAndGivesUp) {
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
  again = Tell(ChunkStored{stored[0].slab, stored[0].chunk.box, 0, Status::DataLoss("digest")});
  ASSERT_THAT(All<SendChunkRequest>(again), SizeIs(1));
  const Actions given_up = After(seconds(3));
  const auto trouble = Sent<WorkerTrouble>(given_up);
  ASSERT_THAT(trouble, SizeIs(1));
  EXPECT_EQ(trouble[0].key, (GroupKey{1, 1, 0}));
  EXPECT_EQ(trouble[0].status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(All<DropSlab>(given_up), SizeIs(1));
  EXPECT_THAT(All<OpenSlab>(Tell(Assignment(1, {kSelf}, 0, 1, 2))), SizeIs(1)) << "the next attempt begins from nothing";
}

TEST_F(WorkerMachineTest, ReportsARefusedChunk) {
  const auto requests = All<SendChunkRequest>(Tell(Assignment(1, {kSelf})));
  ASSERT_FALSE(requests.empty());
  const ChunkRequest& request = requests[0].request;
  const auto trouble =
      Sent<WorkerTrouble>(Tell(ChunkRefused{kEpoch, request.dataset, request.box, request.chunk, Status::NotFound("no such dataset")}));
  ASSERT_THAT(trouble, SizeIs(1));
  EXPECT_EQ(trouble[0].status, Status::NotFound("no such dataset"));
}

TEST_F(WorkerMachineTest, KeepsSlabsForTheNextFrame) {
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

TEST_F(WorkerMachineTest, ALargerHaloReplacesTheSlabOnceItIsCopied) {
  const auto first = All<StartRender>(Feed(Tell(Assignment(1, {kSelf}))));
  Rendered(first.at(0));
  GroupAssignment wider = Assignment(2, {kSelf});
  wider.setup.halo = 16;
  const Actions fed = Feed(Tell(wider));
  ASSERT_THAT(All<StartRender>(fed), SizeIs(1));
  EXPECT_THAT(All<DropSlab>(fed), IsEmpty());
  EXPECT_THAT(All<DropSlab>(Rendered(All<StartRender>(fed)[0])), ElementsAre(testing::Field(&DropSlab::slab, first[0].slab)));
  const Actions narrow = Tell(Assignment(3, {kSelf}));
  EXPECT_THAT(All<SendChunkRequest>(narrow), IsEmpty()) << "the wider slab holds all that the narrower halo needs";
  EXPECT_THAT(All<StartRender>(narrow), SizeIs(1));
}

TEST_F(WorkerMachineTest, FetchesOfAResizedBoxWhatItDoesNotHold) {
  const auto first = All<StartRender>(Feed(Tell(Assignment(1, {kSelf})))).at(0);
  Rendered(first);
  GroupAssignment resized = Assignment(2, {kSelf});
  resized.group.placements[0].box = {{0, 0, 10}, {100, 128, 80}};
  const Actions told = Tell(resized);
  const auto open = All<OpenSlab>(told);
  ASSERT_THAT(open, SizeIs(1));
  ASSERT_THAT(open[0].copies, SizeIs(1));
  EXPECT_EQ(open[0].copies[0].from, first.slab);
  EXPECT_EQ(open[0].copies[0].box, (Box{{0, 0, 2}, {108, 128, 72}})) << "as far as the slab of 72 slices goes";
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

TEST_F(WorkerMachineTest, FetchesAllWhereThereIsNoRoomForWhatItWouldCopyFrom) {
  WorkerConfig config = Config();
  config.cache_bytes = 128 * 128 * 150;
  Start(config);
  const auto first = All<StartRender>(Feed(Tell(Assignment(1, {kSelf})))).at(0);
  Rendered(first);
  GroupAssignment resized = Assignment(2, {kSelf});
  resized.group.placements[0].box = {{0, 0, 10}, {128, 128, 80}};
  const Actions told = Tell(resized);
  EXPECT_THAT(All<DropSlab>(told), ElementsAre(testing::Field(&DropSlab::slab, first.slab)));
  EXPECT_THAT(All<OpenSlab>(told).at(0).copies, IsEmpty());
}

TEST_F(WorkerMachineTest, DropsTheOldestUnusedSlabAboveItsBudget) {
  WorkerConfig config = Config();
  config.cache_bytes = 2 * 128 * 128 * 80;
  Start(config);
  SlabKey oldest;
  for (std::uint32_t group = 0; group < 2; ++group) {
    const auto render = All<StartRender>(Feed(Tell(Assignment(1, {kSelf}, group, 3)))).at(0);
    if (group == 0) oldest = render.slab;
    Rendered(render);
  }
  EXPECT_THAT(All<DropSlab>(Tell(Assignment(1, {kSelf}, 2, 3))), ElementsAre(testing::Field(&DropSlab::slab, oldest)));
}

TEST_F(WorkerMachineTest, AnotherCoordinatorMeansOtherVoxels) {
  const auto first = All<StartRender>(Feed(Tell(Assignment(1, {kSelf})))).at(0);
  Rendered(first);
  Tell(Retire{kEpoch});
  EXPECT_THAT(All<DropSlab>(Tell(WelcomeTo(1001))), IsEmpty()) << "the same coordinator: voxels stay";
  Tell(Retire{kEpoch});
  EXPECT_THAT(All<DropSlab>(Tell(WelcomeTo(1002, kEpoch + 1))), ElementsAre(testing::Field(&DropSlab::slab, first.slab)));
}

// ---------------------------------------------------------------- groups

TEST_F(WorkerMachineTest, RendersOneRankAtATimeInOrderOfFrameAndGroup) {
  Actions later = Feed(Tell(Assignment(2, {kSelf})));
  const auto running = All<StartRender>(later);
  ASSERT_THAT(running, SizeIs(1));
  EXPECT_THAT(All<StartRender>(Feed(Tell(Assignment(1, {kSelf, kSelf}, 1, 2)))), IsEmpty());
  EXPECT_THAT(All<StartRender>(Feed(Tell(Assignment(1, {kSelf}, 0, 2)))), IsEmpty());
  auto next = All<StartRender>(Rendered(running[0]));
  ASSERT_THAT(next, SizeIs(1));
  EXPECT_EQ(next[0].key, (GroupKey{1, 1, 0}));
  next = All<StartRender>(Rendered(next[0]));
  ASSERT_THAT(next, SizeIs(1));
  EXPECT_EQ(next[0].key, (GroupKey{1, 1, 1}));
  EXPECT_EQ(next[0].rank, 0U);
}

TEST_F(WorkerMachineTest, SendsItsImageToTheRootAndForgetsIt) {
  GroupAssignment assignment = Assignment(1, {kPeer, kSelf});
  assignment.display = kPeer;
  const auto render = All<StartRender>(Feed(Tell(assignment))).at(0);
  EXPECT_EQ(render.rank, 1U);
  const Actions done = Rendered(render);
  const auto sent = All<SendPartial>(done);
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_EQ(sent[0].to.worker, kPeer);
  EXPECT_EQ(sent[0].image, render.image);
  EXPECT_EQ(sent[0].message.interval, (RankInterval{1, 2}));
  EXPECT_EQ(sent[0].message.pixels, (PixelRange{0, 8}));
  ASSERT_THAT(sent[0].message.reports, SizeIs(1));
  EXPECT_EQ(sent[0].message.reports[0].worker, kSelf);
  EXPECT_EQ(sent[0].message.reports[0].box, 1U);
  ASSERT_THAT(All<ReleaseImage>(done), SizeIs(1));
  EXPECT_THAT(Tell(assignment), IsEmpty()) << "the same assignment again changes nothing";
}

TEST_F(WorkerMachineTest, DisplayAccumulatesGroupsFrontToBack) {
  const auto back = All<StartRender>(Feed(Tell(Assignment(1, {kSelf}, 1, 2)))).at(0);
  const Actions early = Rendered(back);
  EXPECT_THAT(Sent<GroupDone>(early), IsEmpty()) << "the first group is not there yet";
  const auto front = All<StartRender>(Feed(Tell(Assignment(1, {kSelf}, 0, 2)))).at(0);
  const Actions joined = Rendered(front);
  ASSERT_THAT(Sent<GroupDone>(joined), SizeIs(1));
  EXPECT_EQ(Sent<GroupDone>(joined)[0].key.group, 0U);
  const auto combine = All<StartCombine>(joined);
  ASSERT_THAT(combine, SizeIs(1));
  EXPECT_EQ(combine[0].image, front.image);
  EXPECT_EQ(combine[0].other, back.image);
  EXPECT_EQ(combine[0].side, Side::kBack);
  EXPECT_THAT(All<SendFrame>(joined), IsEmpty());
  const Actions done = Combined(combine[0]);
  ASSERT_THAT(Sent<GroupDone>(done), SizeIs(1));
  ASSERT_THAT(All<SendFrame>(done), SizeIs(1));
  EXPECT_EQ(All<SendFrame>(done)[0].message.groups_done, 2U);
  EXPECT_THAT(All<ReleaseImage>(done), IsEmpty()) << "the coordinator may ask again";
  const Actions over = Tell(Ping{kEpoch, 2, {}});
  ASSERT_THAT(All<ReleaseImage>(over), SizeIs(1));
  EXPECT_EQ(All<ReleaseImage>(over)[0].image, front.image);
  EXPECT_THAT(Tell(Assignment(1, {kSelf}, 1, 2)), IsEmpty()) << "an assignment that comes after the end";
}

TEST_F(WorkerMachineTest, AFrameOfEmptyGroupsIsAnEmptyPicture) {
  const auto combine = All<StartCombine>(Tell(Assignment(1, {})));
  ASSERT_THAT(combine, SizeIs(1));
  EXPECT_EQ(combine[0].other, 0U);
  EXPECT_EQ(combine[0].incoming.header.run_count, 0U);
  const Actions done = Combined(combine[0]);
  EXPECT_THAT(Sent<GroupDone>(done), SizeIs(1));
  ASSERT_THAT(All<SendFrame>(done), SizeIs(1));
  EXPECT_EQ(All<SendFrame>(done)[0].image, combine[0].image);
}

TEST_F(WorkerMachineTest, SendsPreviewsIfAsked) {
  GroupAssignment assignment = Assignment(1, {kSelf}, 0, 2);
  assignment.previews = true;
  const Actions done = Rendered(All<StartRender>(Feed(Tell(assignment))).at(0));
  ASSERT_THAT(All<SendFrame>(done), SizeIs(1));
  EXPECT_EQ(All<SendFrame>(done)[0].message.groups_done, 1U);
}

TEST_F(WorkerMachineTest, KeepsImagesThatComeBeforeTheirAssignment) {
  const GroupAssignment assignment = Assignment(1, {kSelf, kPeer});
  EXPECT_THAT(Tell(FromPeer(assignment.key)), IsEmpty());
  EXPECT_THAT(Tell(FromPeer(assignment.key)), IsEmpty());
  const Actions rendered = Rendered(All<StartRender>(Feed(Tell(assignment))).at(0));
  const auto combine = All<StartCombine>(rendered);
  ASSERT_THAT(combine, SizeIs(1));
  EXPECT_EQ(combine[0].side, Side::kBack);
  EXPECT_THAT(Tell(FromPeer(assignment.key)), IsEmpty());
  const auto done = Sent<GroupDone>(Combined(combine[0]));
  ASSERT_THAT(done, SizeIs(1));
  EXPECT_THAT(done[0].reports, SizeIs(2));
}

TEST_F(WorkerMachineTest, EarlyImagesAreBounded) {
  WorkerConfig config = Config();
  config.early_image_bytes = 10000;
  Start(config);
  const Bytes payload(std::vector<std::byte>(6000));
  EXPECT_THAT(Tell(FromPeer({1, 1, 0}), payload), IsEmpty());
  const auto trouble = Sent<WorkerTrouble>(Tell(FromPeer({2, 1, 0}), payload));
  ASSERT_THAT(trouble, SizeIs(1));
  EXPECT_EQ(trouble[0].key, (GroupKey{2, 1, 0}));
  EXPECT_EQ(trouble[0].status.code(), StatusCode::kResourceExhausted);
  Tell(Ping{kEpoch, 2, {}});  // frame 1 is over: there is room again
  EXPECT_THAT(Tell(FromPeer({2, 1, 0}), payload), IsEmpty());
}

TEST_F(WorkerMachineTest, ANewAttemptReplacesTheOlderOne) {
  const auto old = All<StartRender>(Feed(Tell(Assignment(1, {kSelf, kPeer})))).at(0);
  const Actions replaced = Tell(Assignment(1, {kSelf, kSelf}, 0, 1, 2));
  EXPECT_THAT(All<CancelRender>(replaced), SizeIs(1));
  EXPECT_THAT(All<StartRender>(replaced), IsEmpty()) << "one render at a time, and the cancelled one still runs";
  EXPECT_THAT(Tell(FromPeer({1, 1, 0})), IsEmpty()) << "of the older attempt";
  EXPECT_THAT(Tell(Assignment(1, {kSelf, kPeer})), IsEmpty()) << "of the older attempt";
  const Actions ended = Rendered(old);
  EXPECT_THAT(All<ReleaseImage>(ended), ElementsAre(testing::Field(&ReleaseImage::image, old.image)));
  ASSERT_THAT(All<StartRender>(ended), SizeIs(1));
  EXPECT_EQ(All<StartRender>(ended)[0].key.attempt, 2U);
}

TEST_F(WorkerMachineTest, ImagesOfAnOlderAttemptAreNotKept) {
  WorkerConfig config = Config();
  config.early_image_bytes = 10000;
  Start(config);
  Tell(Assignment(1, {kSelf, kPeer}, 0, 2, 2));
  const Bytes payload(std::vector<std::byte>(9000));
  EXPECT_THAT(Tell(FromPeer({1, 1, 1}), payload), IsEmpty());
  EXPECT_THAT(Tell(FromPeer({1, 2, 1}), payload), IsEmpty()) << "there is room for it";
}

TEST_F(WorkerMachineTest, TheDisplayKeepsWhatItAccumulatedInEarlierAttempts) {
  Rendered(All<StartRender>(Feed(Tell(Assignment(1, {kSelf}, 0, 2)))).at(0));
  const Actions again = Tell(Assignment(1, {kSelf}, 0, 2, 2));
  ASSERT_THAT(Sent<GroupDone>(again), SizeIs(1));
  EXPECT_EQ(Sent<GroupDone>(again)[0].key, (GroupKey{1, 2, 0}));
  EXPECT_THAT(Sent<GroupDone>(again)[0].reports, SizeIs(1));
  EXPECT_THAT(All<StartRender>(again), IsEmpty());

  GroupAssignment last = Assignment(1, {kSelf}, 1, 2, 2);
  last.first_group = 1;
  const Actions rendered = Rendered(All<StartRender>(Feed(Tell(last))).at(0));
  EXPECT_THAT(All<SendFrame>(Combined(All<StartCombine>(rendered).at(0))), SizeIs(1));
  // The frame was lost on its way: the coordinator hands the last group out again.
  last.key.attempt = 3;
  const Actions asked = Tell(last);
  EXPECT_THAT(Sent<GroupDone>(asked), SizeIs(1));
  EXPECT_THAT(All<SendFrame>(asked), SizeIs(1));
  EXPECT_THAT(Tell(last), IsEmpty());
}

TEST_F(WorkerMachineTest, TheDisplayDoesNotAskForAGroupThatIsBeingCombined) {
  Rendered(All<StartRender>(Feed(Tell(Assignment(1, {kSelf}, 0, 2)))).at(0));
  const Actions rendered = Rendered(All<StartRender>(Feed(Tell(Assignment(1, {kSelf}, 1, 2)))).at(0));
  EXPECT_THAT(Tell(Assignment(1, {kSelf}, 1, 2, 2)), IsEmpty());
  const auto done = Sent<GroupDone>(Combined(All<StartCombine>(rendered).at(0)));
  ASSERT_THAT(done, SizeIs(1));
  EXPECT_EQ(done[0].key, (GroupKey{1, 2, 1}));
}

TEST_F(WorkerMachineTest, TheDisplaySaysIfItLacksGroups) {
  GroupAssignment assignment = Assignment(1, {kSelf}, 1, 2, 2);
  assignment.first_group = 1;
  const auto trouble = Sent<WorkerTrouble>(Tell(assignment));
  ASSERT_THAT(trouble, SizeIs(1));
  EXPECT_EQ(trouble[0].key, assignment.key);
}

// ---------------------------------------------------------------- hidden tiles

class HiddenTilesTest : public WorkerMachineTest {
 protected:
  // Of a frame that may leave out what is hidden.
  static GroupAssignment Group(std::uint32_t group, std::uint32_t group_count, std::uint32_t attempt = 1) {
    GroupAssignment assignment = Assignment(1, {kSelf}, group, group_count, attempt);
    assignment.setup.termination = kDefaultTermination;
    return assignment;
  }
  Actions Found(const FindHidden& find, const OcclusionMask& hidden) { return Tell(HiddenFound{find.key, find.image, hidden}); }

  const OcclusionMask tile{1, 1, {1}};
};

TEST_F(HiddenTilesTest, AreLookedForAfterEachGroupButTheLastAndReportedWithIt) {
  const auto first = All<StartRender>(Feed(Tell(Group(0, 3)))).at(0);
  Actions actions = Rendered(first);
  auto find = All<FindHidden>(actions);
  ASSERT_THAT(find, SizeIs(1));
  EXPECT_EQ(find[0].image, first.image);
  EXPECT_TRUE(find[0].known.empty());
  EXPECT_THAT(Sent<GroupDone>(actions), IsEmpty());
  auto done = Sent<GroupDone>(Found(find[0], {}));
  ASSERT_THAT(done, SizeIs(1));
  EXPECT_EQ(done[0].key.group, 0U);
  EXPECT_TRUE(done[0].hidden.empty());

  actions = Rendered(All<StartRender>(Feed(Tell(Group(1, 3)))).at(0));
  find = All<FindHidden>(actions);
  ASSERT_THAT(find, SizeIs(1)) << "ordered at once, so that it runs right behind the combine";
  EXPECT_THAT(Sent<GroupDone>(Combined(All<StartCombine>(actions).at(0))), IsEmpty());
  done = Sent<GroupDone>(Found(find[0], tile));
  ASSERT_THAT(done, SizeIs(1));
  EXPECT_EQ(done[0].key.group, 1U);
  EXPECT_EQ(done[0].hidden, tile);
  EXPECT_THAT(done[0].reports, SizeIs(1));
  const auto again = Sent<GroupDone>(Tell(Group(1, 3, 2)));
  ASSERT_THAT(again, SizeIs(1));
  EXPECT_EQ(again[0].hidden, tile) << "the first report may be lost";

  actions = Rendered(All<StartRender>(Feed(Tell(Group(2, 3, 2)))).at(0));
  EXPECT_THAT(All<FindHidden>(actions), IsEmpty()) << "nothing lies behind";
  done = Sent<GroupDone>(Combined(All<StartCombine>(actions).at(0)));
  ASSERT_THAT(done, SizeIs(1));
  EXPECT_TRUE(done[0].hidden.empty());
}

TEST_F(HiddenTilesTest, AReportOfFewerGroupsThanAreDoneTellsNothing) {
  const auto find = All<FindHidden>(Rendered(All<StartRender>(Feed(Tell(Group(0, 3)))).at(0)));
  Found(find.at(0), {});
  const Actions second = Rendered(All<StartRender>(Feed(Tell(Group(1, 3)))).at(0));
  Combined(All<StartCombine>(second).at(0));
  Found(All<FindHidden>(second).at(0), tile);
  const auto again = Sent<GroupDone>(Tell(Group(0, 3, 2)));
  ASSERT_THAT(again, SizeIs(1));
  EXPECT_EQ(again[0].key.group, 0U);
  EXPECT_TRUE(again[0].hidden.empty()) << "the tile is hidden by group 1, not by group 0";
}

TEST_F(HiddenTilesTest, AreNotLookedForWhereNothingMayBeLeftOut) {
  GroupAssignment exact = Group(0, 3);
  exact.setup.termination = 0;
  GroupAssignment depth = Group(0, 3);
  depth.key.frame = 2;
  depth.setup.renderer = RendererKind::kZBuffer;
  depth.setup.camera.width = 4;
  depth.setup.camera.height = 2;
  GroupAssignment only = Group(0, 1);
  only.key.frame = 3;
  for (const GroupAssignment& assignment : {exact, depth, only}) {
    const Actions rendered = Rendered(All<StartRender>(Feed(Tell(assignment))).at(0));
    EXPECT_THAT(All<FindHidden>(rendered), IsEmpty());
    EXPECT_THAT(Sent<GroupDone>(rendered), SizeIs(1));
  }
}

TEST_F(HiddenTilesTest, GoWithTheRendersOfTheirGroup) {
  GroupAssignment assignment = Group(1, 3);
  assignment.display = kPeer;
  assignment.group.placements[0].box = {{0, 0, 0}, {128, 128, 64}};
  assignment.setup.sheets.width = 32;
  assignment.hidden = {2, 1, {0, 1}};
  const auto render = All<StartRender>(Feed(Tell(assignment)));
  ASSERT_THAT(render, SizeIs(1));
  EXPECT_EQ(*render[0].hidden, assignment.hidden);
}

TEST_F(HiddenTilesTest, ABoxThatTheyHideAsAWholeIsNeitherFetchedNorRendered) {
  GroupAssignment assignment = Group(1, 3);
  assignment.display = kPeer;
  assignment.hidden = tile;
  const Actions told = Tell(assignment);
  EXPECT_THAT(All<OpenSlab>(told), IsEmpty());
  EXPECT_THAT(All<SendChunkRequest>(told), IsEmpty());
  EXPECT_THAT(All<StartRender>(told), IsEmpty());
  const auto made = All<StartCombine>(told);
  ASSERT_THAT(made, SizeIs(1));
  EXPECT_EQ(made[0].other, 0U);
  EXPECT_EQ(made[0].incoming.header, RunImageHeader{}) << "an empty picture";
  const Actions done = Combined(made[0]);
  const auto sent = All<SendPartial>(done);
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_EQ(sent[0].image, made[0].image);
  EXPECT_EQ(sent[0].to.worker, kPeer);
  EXPECT_EQ(sent[0].message.interval, (RankInterval{0, 1}));
  ASSERT_THAT(sent[0].message.reports, SizeIs(1));
  EXPECT_EQ(sent[0].message.reports[0].box, assignment.group.placements[0].id);
  EXPECT_EQ(sent[0].message.reports[0].worker, kSelf);
  EXPECT_THAT(All<ReleaseImage>(done), ElementsAre(testing::Field(&ReleaseImage::image, made[0].image)));
  EXPECT_THAT(Tell(assignment), IsEmpty()) << "the same assignment again changes nothing";
}

TEST_F(HiddenTilesTest, AnAnswerAfterTheEndOfTheFrameChangesNothing) {
  const auto find = All<FindHidden>(Rendered(All<StartRender>(Feed(Tell(Group(0, 3)))).at(0)));
  EXPECT_THAT(All<ReleaseImage>(Tell(Ping{kEpoch, 0, {1}})), SizeIs(1));
  EXPECT_THAT(Found(find.at(0), tile), IsEmpty());
}

TEST_F(WorkerMachineTest, CancelledFramesAreForgotten) {
  const auto render = All<StartRender>(Feed(Tell(Assignment(5, {kSelf})))).at(0);
  EXPECT_THAT(All<CancelRender>(Tell(Ping{kEpoch, 0, {5}})), SizeIs(1));
  EXPECT_THAT(Tell(Assignment(5, {kSelf}, 0, 1, 2)), IsEmpty());
  EXPECT_THAT(Tell(FromPeer({5, 2, 0})), IsEmpty());
  const Actions late = Rendered(render);
  EXPECT_THAT(late, SizeIs(1));
  EXPECT_THAT(All<ReleaseImage>(late), SizeIs(1));
}

TEST_F(WorkerMachineTest, AFailedRenderIsReported) {
  const auto render = All<StartRender>(Feed(Tell(Assignment(1, {kSelf})))).at(0);
  const Actions failed = Rendered(render, Status::ResourceExhausted("no memory"));
  const auto trouble = Sent<WorkerTrouble>(failed);
  ASSERT_THAT(trouble, SizeIs(1));
  EXPECT_EQ(trouble[0].status, Status::ResourceExhausted("no memory"));
  EXPECT_THAT(All<ReleaseImage>(failed), SizeIs(1));
  EXPECT_THAT(All<StartRender>(Tell(Assignment(1, {kSelf}, 0, 1, 2))), SizeIs(1));
}

TEST_F(WorkerMachineTest, AFailedCombineIsReported) {
  const GroupAssignment assignment = Assignment(1, {kSelf, kPeer});
  Tell(FromPeer(assignment.key));
  const Actions rendered = Rendered(All<StartRender>(Feed(Tell(assignment))).at(0));
  const Actions failed = Combined(All<StartCombine>(rendered).at(0), Status::DataLoss("runs"));
  EXPECT_THAT(Sent<WorkerTrouble>(failed), SizeIs(1));
  EXPECT_THAT(All<ReleaseImage>(failed), SizeIs(1));
  EXPECT_THAT(Sent<GroupDone>(failed), IsEmpty());
}

TEST_F(WorkerMachineTest, AnUnreachablePeerIsReportedForItsGroups) {
  Tell(Assignment(1, {kSelf, kPeer}));
  const auto trouble = Sent<WorkerTrouble>(Tell(PeerUnreachable{kPeer}));
  ASSERT_THAT(trouble, SizeIs(1));
  EXPECT_EQ(trouble[0].unreachable, kPeer);
  EXPECT_THAT(Sent<WorkerTrouble>(Tell(PeerUnreachable{99})), IsEmpty());
}

TEST_F(WorkerMachineTest, LosingTheCoordinatorReleasesEverything) {
  const auto first = All<StartRender>(Feed(Tell(Assignment(1, {kSelf}, 0, 2)))).at(0);
  Rendered(first);
  const auto second = All<StartRender>(Feed(Tell(Assignment(1, {kSelf}, 1, 2)))).at(0);
  const Actions lost = After(seconds(6));
  EXPECT_THAT(All<CancelRender>(lost), SizeIs(1));
  EXPECT_THAT(All<ReleaseImage>(lost), ElementsAre(testing::Field(&ReleaseImage::image, first.image)));
  EXPECT_THAT(All<DropSlab>(lost), IsEmpty());
  EXPECT_THAT(All<ReleaseImage>(Rendered(second)), SizeIs(1));
}

}  // namespace
}  // namespace slabstream
