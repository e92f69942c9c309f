// The worker machine of the display worker: groups become a frame.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/worker/worker_machine_fixture.h"

namespace slabstream {
namespace {

using testing::Each;
using testing::VariantWith;

class DisplayWorkerTest : public WorkerMachineTest {};

TEST_F(DisplayWorkerTest, AccumulatesGroupsFrontToBack) {
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

TEST_F(DisplayWorkerTest, AFrameOfEmptyGroupsIsAnEmptyPicture) {
  const auto combine = All<StartCombine>(Tell(Assignment(1, {})));
  ASSERT_THAT(combine, SizeIs(1));
  EXPECT_EQ(combine[0].other, 0U);
  EXPECT_EQ(combine[0].incoming->header.run_count, 0U);
  const Actions done = Combined(combine[0]);
  EXPECT_THAT(Sent<GroupDone>(done), SizeIs(1));
  ASSERT_THAT(All<SendFrame>(done), SizeIs(1));
  EXPECT_EQ(All<SendFrame>(done)[0].image, combine[0].image);
}

TEST_F(DisplayWorkerTest, SendsPreviewsIfAsked) {
  GroupAssignment assignment = Assignment(1, {kSelf}, 0, 2);
  assignment.previews = true;
  const Actions done = Rendered(All<StartRender>(Feed(Tell(assignment))).at(0));
  ASSERT_THAT(All<SendFrame>(done), SizeIs(1));
  EXPECT_EQ(All<SendFrame>(done)[0].message.groups_done, 1U);
}

TEST_F(DisplayWorkerTest, SendsNoMorePreviewsThanSomebodyCanSee) {
  const auto pictures = [&](std::uint32_t group) {
    GroupAssignment assignment = Assignment(1, {kSelf}, group, 5);
    assignment.previews = true;
    const Actions rendered = Rendered(All<StartRender>(Feed(Tell(assignment))).at(0));
    const auto combine = All<StartCombine>(rendered);
    return All<SendFrame>(combine.empty() ? rendered : Combined(combine.at(0))).size();
  };
  const Duration interval = WorkerConfig().preview_interval;
  EXPECT_EQ(pictures(0), 1U);
  now += interval - milliseconds(1);
  EXPECT_EQ(pictures(1), 0U);
  now += milliseconds(1);
  EXPECT_EQ(pictures(2), 1U);
  EXPECT_EQ(pictures(3), 0U);
  EXPECT_EQ(pictures(4), 1U) << "the frame";
}

TEST_F(DisplayWorkerTest, KeepsWhatItAccumulatedInEarlierAttempts) {
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

TEST_F(DisplayWorkerTest, DoesNotAskForAGroupThatIsBeingCombined) {
  Rendered(All<StartRender>(Feed(Tell(Assignment(1, {kSelf}, 0, 2)))).at(0));
  const Actions rendered = Rendered(All<StartRender>(Feed(Tell(Assignment(1, {kSelf}, 1, 2)))).at(0));
  EXPECT_THAT(Tell(Assignment(1, {kSelf}, 1, 2, 2)), Each(VariantWith<ForgetGroups>(testing::_)));
  const auto done = Sent<GroupDone>(Combined(All<StartCombine>(rendered).at(0)));
  ASSERT_THAT(done, SizeIs(1));
  EXPECT_EQ(done[0].key, (GroupKey{1, 2, 1}));
}

TEST_F(DisplayWorkerTest, SaysIfItLacksGroups) {
  GroupAssignment assignment = Assignment(1, {kSelf}, 1, 2, 2);
  assignment.first_group = 1;
  const auto trouble = Sent<WorkerTrouble>(Tell(assignment));
  ASSERT_THAT(trouble, SizeIs(1));
  EXPECT_EQ(trouble[0].key, assignment.key);
}

}  // namespace
}  // namespace slabstream
