// The worker machine and what need not be rendered: found by the display worker, left out by all.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/renderers.h"
#include "tests/worker/worker_machine_fixture.h"

namespace slabstream {
namespace {

class HiddenTilesTest : public WorkerMachineTest {
 protected:
  // Of a frame that may leave out what is hidden.
  static GroupAssignment Group(std::uint32_t group, std::uint32_t group_count, std::uint32_t attempt = 1) {
    GroupAssignment assignment = Assignment(1, {kSelf}, group, group_count, attempt);
    assignment.setup.termination = kDefaultTermination;
    return assignment;
  }
  Actions Found(const FindHidden& find, const OcclusionMask& hidden) { return Tell(HiddenFound{find.key, find.image, hidden}); }

  const OcclusionMask tile{1, 1, {kOcclusionSteps}};
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
  SetRenderer(*ZBuffer(), depth.setup);
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
  assignment.hidden = {2, 1, {0, kOcclusionSteps}};
  const auto render = All<StartRender>(Feed(Tell(assignment)));
  ASSERT_THAT(render, SizeIs(1));
  EXPECT_EQ(*render[0].hidden, assignment.hidden);
}

TEST_F(HiddenTilesTest, ABoxThatTheyHideAsAWholeIsNeitherFetchedNorRendered) {
  GroupAssignment assignment = Group(1, 3);
  assignment.display = kPeer;
  assignment.hidden = tile;
  const Actions told = Tell(assignment);
  EXPECT_THAT(All<OpenBox>(told), IsEmpty());
  EXPECT_THAT(All<SendChunkRequest>(told), IsEmpty());
  EXPECT_THAT(All<StartRender>(told), IsEmpty());
  const auto made = All<StartCombine>(told);
  ASSERT_THAT(made, SizeIs(1));
  EXPECT_EQ(made[0].other, 0U);
  EXPECT_EQ(made[0].incoming->header, RunImageHeader{}) << "an empty picture";
  const Actions done = Combined(made[0]);
  const auto sent = All<SendPartial>(done);
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_EQ(sent[0].image, made[0].image);
  EXPECT_EQ(sent[0].to->worker, kPeer);
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

}  // namespace
}  // namespace slabstream
