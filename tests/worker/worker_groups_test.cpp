// The worker machine and its groups: what is rendered and sent, in which order, what comes early or of another attempt, and what fails.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "tests/worker/worker_machine_fixture.h"

namespace slabstream {
namespace {

class WorkerGroupsTest : public WorkerMachineTest {};

TEST_F(WorkerGroupsTest, RendersOneRankAtATimeInOrderOfFrameAndGroup) {
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

TEST_F(WorkerGroupsTest, SendsItsImageToTheRootAndForgetsIt) {
  GroupAssignment assignment = Assignment(1, {kPeer, kSelf});
  assignment.display = kPeer;
  const auto render = All<StartRender>(Feed(Tell(assignment))).at(0);
  EXPECT_EQ(render.rank, 1U);
  const Actions done = Rendered(render);
  const auto sent = All<SendPartial>(done);
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_EQ(sent[0].to->worker, kPeer);
  EXPECT_EQ(sent[0].image, render.image);
  EXPECT_EQ(sent[0].message.interval, (RankInterval{1, 2}));
  EXPECT_EQ(sent[0].message.pixels, (PixelRange{0, 8}));
  ASSERT_THAT(sent[0].message.reports, SizeIs(1));
  EXPECT_EQ(sent[0].message.reports[0].worker, kSelf);
  EXPECT_EQ(sent[0].message.reports[0].box, 1U);
  ASSERT_THAT(All<ReleaseImage>(done), SizeIs(1));
  EXPECT_THAT(Tell(assignment), IsEmpty()) << "the same assignment again changes nothing";
}

TEST_F(WorkerGroupsTest, KeepsImagesThatComeBeforeTheirAssignment) {
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

TEST_F(WorkerGroupsTest, KeepsImagesThatComeBeforeTheWelcome) {
  Start(Config(), false);
  Tell(Tick{});
  const GroupAssignment assignment = Assignment(1, {kSelf, kPeer});
  PartialImage foreign = FromPeer(assignment.key);
  foreign.epoch = kEpoch + 1;
  EXPECT_THAT(Tell(foreign), IsEmpty());
  EXPECT_THAT(Tell(FromPeer(assignment.key)), IsEmpty());
  Tell(WelcomeTo(1000));
  const Actions rendered = Rendered(All<StartRender>(Feed(Tell(assignment))).at(0));
  EXPECT_THAT(All<StartCombine>(rendered), SizeIs(1)) << "with the image of its epoch";
}

TEST_F(WorkerGroupsTest, EarlyImagesAreBounded) {
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

TEST_F(WorkerGroupsTest, ReportsOfEarlyImagesCount) {
  WorkerConfig config = Config();
  config.early_image_bytes = 10000;
  Start(config);
  PartialImage partial = FromPeer({1, 1, 0});
  partial.reports.resize(10000 / sizeof(RankReport) + 1);
  const auto trouble = Sent<WorkerTrouble>(Tell(partial));
  ASSERT_THAT(trouble, SizeIs(1));
  EXPECT_EQ(trouble[0].status.code(), StatusCode::kResourceExhausted);
}

// A frame of the far future would hold them for ever.
TEST_F(WorkerGroupsTest, EarlyImagesAreForgottenInTime) {
  WorkerConfig config = Config();
  config.early_image_bytes = 10000;
  config.early_image_patience = std::chrono::seconds(2);
  Start(config);
  const Bytes payload(std::vector<std::byte>(6000));
  EXPECT_THAT(Tell(FromPeer({std::uint64_t{1} << 63U, 1, 0}), payload), IsEmpty());
  EXPECT_EQ(machine->sizes().early_images, 1U);
  EXPECT_THAT(Sent<WorkerTrouble>(Tell(FromPeer({1, 1, 0}), payload)), SizeIs(1)) << "no room beside it";
  now += config.early_image_patience + Duration(1);
  Tell(Ping{kEpoch, 0, {}});
  EXPECT_EQ(machine->sizes().early_images, 0U);
  EXPECT_THAT(Tell(FromPeer({1, 1, 0}), payload), IsEmpty());
}

TEST_F(WorkerGroupsTest, ANewAttemptReplacesTheOlderOne) {
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

TEST_F(WorkerGroupsTest, ImagesOfAnOlderAttemptAreNotKept) {
  WorkerConfig config = Config();
  config.early_image_bytes = 10000;
  Start(config);
  Tell(Assignment(1, {kSelf, kPeer}, 0, 2, 2));
  const Bytes payload(std::vector<std::byte>(9000));
  EXPECT_THAT(Tell(FromPeer({1, 1, 1}), payload), IsEmpty());
  EXPECT_THAT(Tell(FromPeer({1, 2, 1}), payload), IsEmpty()) << "there is room for it";
}

TEST_F(WorkerGroupsTest, CancelledFramesAreForgotten) {
  const auto render = All<StartRender>(Feed(Tell(Assignment(5, {kSelf})))).at(0);
  EXPECT_THAT(All<CancelRender>(Tell(Ping{kEpoch, 0, {5}})), SizeIs(1));
  EXPECT_THAT(Tell(Assignment(5, {kSelf}, 0, 1, 2)), IsEmpty());
  EXPECT_THAT(Tell(FromPeer({5, 2, 0})), IsEmpty());
  const Actions late = Rendered(render);
  EXPECT_THAT(late, SizeIs(1));
  EXPECT_THAT(All<ReleaseImage>(late), SizeIs(1));
}

TEST_F(WorkerGroupsTest, AFailedRenderIsReported) {
  const auto render = All<StartRender>(Feed(Tell(Assignment(1, {kSelf})))).at(0);
  const Actions failed = Rendered(render, Status::ResourceExhausted("no memory"));
  const auto trouble = Sent<WorkerTrouble>(failed);
  ASSERT_THAT(trouble, SizeIs(1));
  EXPECT_EQ(trouble[0].status, Status::ResourceExhausted("no memory"));
  EXPECT_TRUE(trouble[0].elsewhere);
  EXPECT_THAT(All<ReleaseImage>(failed), SizeIs(1));
  EXPECT_THAT(All<StartRender>(Tell(Assignment(1, {kSelf}, 0, 1, 2))), SizeIs(1));
}

TEST_F(WorkerGroupsTest, AFailedSendIsReported) {
  const GroupAssignment assignment = Assignment(1, {kPeer, kSelf});
  Rendered(All<StartRender>(Feed(Tell(assignment))).at(0));
  const auto trouble = Sent<WorkerTrouble>(Tell(SendFailed{assignment.key, Status::ResourceExhausted("encode: not enough memory")}));
  ASSERT_THAT(trouble, SizeIs(1));
  EXPECT_EQ(trouble[0].key, assignment.key);
  EXPECT_EQ(trouble[0].status.message(), "encode: not enough memory");
  EXPECT_TRUE(trouble[0].elsewhere);
  const GroupKey old{1, 0, 0};
  EXPECT_THAT(Tell(SendFailed{old, Status::ResourceExhausted("of an attempt that is over")}), IsEmpty());
}

TEST_F(WorkerGroupsTest, AFailedCombineIsReported) {
  const GroupAssignment assignment = Assignment(1, {kSelf, kPeer});
  Tell(FromPeer(assignment.key));
  const Actions rendered = Rendered(All<StartRender>(Feed(Tell(assignment))).at(0));
  const Actions failed = Combined(All<StartCombine>(rendered).at(0), Status::DataLoss("runs"));
  ASSERT_THAT(Sent<WorkerTrouble>(failed), SizeIs(1));
  EXPECT_FALSE(Sent<WorkerTrouble>(failed)[0].elsewhere) << "what came was damaged, which says nothing of this worker";
  EXPECT_THAT(All<ReleaseImage>(failed), SizeIs(1));
  EXPECT_THAT(Sent<GroupDone>(failed), IsEmpty());
}

TEST_F(WorkerGroupsTest, AnUnreachablePeerIsReportedForItsGroups) {
  Tell(Assignment(1, {kSelf, kPeer}));
  const auto trouble = Sent<WorkerTrouble>(Tell(PeerUnreachable{kPeer}));
  ASSERT_THAT(trouble, SizeIs(1));
  EXPECT_EQ(trouble[0].unreachable, kPeer);
  EXPECT_THAT(Sent<WorkerTrouble>(Tell(PeerUnreachable{99})), IsEmpty());
}

// An image that was sent may be lost with its connection: that concerns groups that are over here, while the frame is not.
TEST_F(WorkerGroupsTest, AnUnreachablePeerIsReportedForTheLastGroupWithIt) {
  for (const std::uint32_t group : {0, 1}) {
    GroupAssignment assignment = Assignment(1, {kPeer, kSelf}, group, 3);
    assignment.display = kPeer;
    EXPECT_THAT(All<SendPartial>(Rendered(All<StartRender>(Feed(Tell(assignment))).at(0))), SizeIs(1));
  }
  const auto trouble = Sent<WorkerTrouble>(Tell(PeerUnreachable{kPeer}));
  ASSERT_THAT(trouble, SizeIs(1));
  EXPECT_EQ(trouble[0].unreachable, kPeer);
  EXPECT_EQ(trouble[0].key, (GroupKey{1, 1, 1}));
  Tell(Ping{kEpoch, 2, {}});
  EXPECT_THAT(Sent<WorkerTrouble>(Tell(PeerUnreachable{kPeer})), IsEmpty()) << "the frame is finished";
}

}  // namespace
}  // namespace slabstream
