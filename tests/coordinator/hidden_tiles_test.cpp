// What display workers find hidden: which assignments it goes with, and which it must not.
#include "common/planning/frame_occlusion.h"
#include "tests/coordinator/coordinator_script.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

// A mask of the frame with the first `hidden` tiles hidden.
OcclusionMask Mask(const GroupAssignment& group, std::size_t hidden) {
  const PixelBounds frame = FrameBounds(group.setup);
  OcclusionMask mask{OcclusionTiles(frame.width()), OcclusionTiles(frame.height()), {}};
  mask.steps.resize(std::size_t(mask.tiles_x) * std::size_t(mask.tiles_y));
  EXPECT_GT(mask.steps.size(), hidden);
  std::fill_n(mask.steps.begin(), hidden, kOcclusionSteps);
  return mask;
}

TEST(CoordinatorHiddenTiles, TheNewestMaskGoesWithLaterGroups) {
  CoordinatorScript script;
  script.Join(11, 1);
  const auto first = HandedOut(script.Submit(kClient, Frame(1, 5)));
  ASSERT_EQ(first.size(), 2U);
  EXPECT_TRUE(first[0].hidden.empty() && first[1].hidden.empty());
  const OcclusionMask one = Mask(first[0], 1), three = Mask(first[0], 3);
  const auto third = HandedOut(script.Done(first[0], {}, one));
  ASSERT_THAT(Keys(third), ElementsAre(GroupKey{1, 1, 2}));
  EXPECT_EQ(third[0].hidden, one);
  const auto fourth = HandedOut(script.Done(first[1]));
  ASSERT_EQ(fourth.size(), 1U);
  EXPECT_EQ(fourth[0].hidden, one) << "what was hidden stays hidden";
  const auto fifth = HandedOut(script.Done(third[0], {}, three));
  ASSERT_EQ(fifth.size(), 1U);
  EXPECT_EQ(fifth[0].hidden, three);
  EXPECT_TRUE(HandedOut(script.Submit(kClient, Frame(2, 2))).empty());
  const auto next_frame = HandedOut(script.Done(fourth[0]));
  ASSERT_EQ(next_frame.size(), 1U);
  EXPECT_TRUE(next_frame[0].hidden.empty()) << "another frame";
}

TEST(CoordinatorHiddenTiles, MasksThatComeLateChangeNothing) {
  CoordinatorScript script;
  script.Join(11, 1);
  const auto first = HandedOut(script.Submit(kClient, Frame(1, 4)));
  const auto more = HandedOut(script.Done(first[1], {}, Mask(first[0], 3)));  // which says that group 0 is done, too
  ASSERT_THAT(Keys(more), ElementsAre(GroupKey{1, 1, 2}, GroupKey{1, 1, 3}));
  EXPECT_EQ(more[0].hidden, Mask(first[0], 3));
  script.Done(first[0], {}, Mask(first[0], 1));
  const auto again = HandedOut(script.Pass(seconds(60)));  // no progress: handed out once more
  ASSERT_THAT(Keys(again), ElementsAre(GroupKey{1, 2, 2}, GroupKey{1, 2, 3}));
  EXPECT_EQ(again[0].hidden, Mask(first[0], 3));
}

TEST(CoordinatorHiddenTiles, AMaskOutlivesAttemptsButNotItsDisplayWorker) {
  CoordinatorScript script;
  for (PeerToken token = 1; token <= 3; ++token) script.Join(token, token);
  const auto first = HandedOut(script.Submit(kClient, Frame(1, 4)));
  const OcclusionMask mask = Mask(first[0], 2);
  EXPECT_EQ(HandedOut(script.Done(first[0], {}, mask)).at(0).hidden, mask);

  const auto renderer =
      std::find_if(script.workers.begin(), script.workers.end(), [&](const FakeWorker& worker) { return worker.id != first[0].display; });
  const auto second = HandedOut(script.Kill(*renderer));
  ASSERT_THAT(Keys(second), ElementsAre(GroupKey{1, 2, 1}, GroupKey{1, 2, 2}));
  EXPECT_EQ(second[0].hidden, mask);
  EXPECT_EQ(second[1].hidden, mask);

  const FakeWorker display = script.WorkerOf(first[0].display);
  const auto third = HandedOut(script.Kill(display));
  ASSERT_THAT(Keys(third), ElementsAre(GroupKey{1, 3, 0}, GroupKey{1, 3, 1}));
  EXPECT_TRUE(third[0].hidden.empty() && third[1].hidden.empty());
  EXPECT_TRUE(script.Worker(display, GroupDone{77, display.id, {1, 2, 1}, {}, Mask(first[0], 3)}).empty()) << "it is gone";
  const auto later = HandedOut(script.Done(third[0]));
  ASSERT_THAT(Keys(later), ElementsAre(GroupKey{1, 3, 2}));
  EXPECT_TRUE(later[0].hidden.empty()) << "nothing that the new display worker found";
}

TEST(CoordinatorHiddenTiles, NoGroupIsToldWhatItHidesItself) {
  CoordinatorScript script;
  script.Join(11, 1);
  const auto first = HandedOut(script.Submit(kClient, Frame(1, 2)));
  script.Done(first[0], {}, Mask(first[0], 1));
  script.Done(first[1], {}, Mask(first[0], 2));
  const auto again = HandedOut(script.Pass(seconds(60)));  // the picture did not come
  ASSERT_THAT(Keys(again), ElementsAre(GroupKey{1, 2, 1}));
  EXPECT_TRUE(again[0].hidden.empty());
}

TEST(CoordinatorHiddenTiles, MasksThatDoNotFitTheFrameAreDropped) {
  for (const int which : {0, 1, 2}) {
    CoordinatorScript script;
    script.Join(11, 1);
    SubmitFrame submit = Frame(1, 3);
    if (which == 1) submit.frame.termination = 0;
    if (which == 2) submit.frame.renderer = ZBuffer()->name();
    const auto first = HandedOut(script.Submit(kClient, submit));
    OcclusionMask mask = Mask(first.at(0), 1);
    if (which == 0) mask = {mask.tiles_x + 1, 1, std::vector<std::uint8_t>(std::size_t(mask.tiles_x) + 1, 1)};
    const auto next = HandedOut(script.Done(first[0], {}, mask));
    ASSERT_THAT(Keys(next), ElementsAre(GroupKey{1, 1, 2})) << "the group is done all the same";
    EXPECT_TRUE(next[0].hidden.empty()) << which;
  }
}

}  // namespace
}  // namespace slabstream
