// Clients take turns at rendering: a render that takes long pauses for others, and each gets its share of the worker's time.
#include <gmock/gmock.h>

#include <map>

#include "common/planning/worker_memory.h"
#include "common/renderers/registry.h"
#include "common/volume/memory_budget.h"
#include "tests/support/random.h"
#include "tests/worker/worker_machine_fixture.h"
#include "worker/machine/render_queue.h"

namespace slabstream {
namespace {

class RenderTurnsTest : public WorkerMachineTest {
 protected:
  // One box of a frame of this client, of a dataset of its own unless it is given.
  GroupAssignment FrameOf(ClientId client, FrameId frame, DatasetId dataset = 0) {
    GroupAssignment a = Assignment(frame, {kSelf});
    a.client = client;
    a.setup.dataset = dataset == 0 ? DatasetId(client) : dataset;
    return a;
  }
  // The same with images that have a size.
  GroupAssignment Sized(ClientId client, DatasetId dataset = 0) {
    GroupAssignment a = FrameOf(client, FrameId(client), dataset);
    SetRenderer(*FindRenderer("raycast"), a.setup);
    a.setup.sheets = {};
    a.setup.camera = MakeCamera({}, {16, 16}, a.setup.description.geometry);
    return a;
  }
  Actions Assign(const GroupAssignment& assignment) { return Feed(Tell(assignment)); }
};

testing::Matcher<PauseRender> Pauses(const StartRender& render) { return testing::Field(&PauseRender::image, render.image); }
testing::Matcher<ResumeRender> Resumes(const StartRender& render) { return testing::Field(&ResumeRender::image, render.image); }

TEST_F(RenderTurnsTest, ALongRenderPausesForAnotherClientAndThenGoesOn) {
  const StartRender large = All<StartRender>(Assign(FrameOf(1, 1))).at(0);
  now += std::chrono::seconds(3);
  const Actions begun = Assign(FrameOf(2, 2));
  EXPECT_THAT(All<PauseRender>(begun), ElementsAre(Pauses(large)));
  ASSERT_THAT(All<StartRender>(begun), SizeIs(1)) << "it waits for nothing";
  EXPECT_EQ(All<StartRender>(begun)[0].client, 2U);
  now += std::chrono::milliseconds(2);
  const Actions ended = Rendered(All<StartRender>(begun)[0]);
  EXPECT_THAT(All<ResumeRender>(ended), ElementsAre(Resumes(large)));
  EXPECT_THAT(All<StartRender>(ended), IsEmpty());
}

TEST_F(RenderTurnsTest, ATurnLastsForAWhileAndNoLonger) {
  const StartRender first = All<StartRender>(Assign(FrameOf(1, 1))).at(0);
  const Actions waits = Assign(FrameOf(2, 2));
  EXPECT_THAT(All<PauseRender>(waits), IsEmpty());
  EXPECT_THAT(All<StartRender>(waits), IsEmpty());
  EXPECT_THAT(All<PauseRender>(After(RenderQueue::kTurn - Duration(1))), IsEmpty());
  const Actions turned = After(Duration(1));
  EXPECT_THAT(All<PauseRender>(turned), ElementsAre(Pauses(first)));
  EXPECT_THAT(All<StartRender>(turned), SizeIs(1));
}

TEST_F(RenderTurnsTest, NobodyPausesForFramesOfItsOwn) {
  EXPECT_THAT(All<StartRender>(Assign(FrameOf(1, 1))), SizeIs(1));
  EXPECT_THAT(All<StartRender>(Assign(FrameOf(1, 2))), IsEmpty());
  EXPECT_THAT(All<PauseRender>(After(std::chrono::seconds(1))), IsEmpty());
}

TEST_F(RenderTurnsTest, ClientsOfTheSameDatasetTakeTurnsToo) {
  const StartRender large = All<StartRender>(Assign(FrameOf(1, 1, 7))).at(0);
  now += std::chrono::seconds(1);
  const Actions begun = Assign(FrameOf(2, 2, 7));
  EXPECT_THAT(All<PauseRender>(begun), ElementsAre(Pauses(large)));
  ASSERT_THAT(All<StartRender>(begun), SizeIs(1));
  EXPECT_EQ(All<StartRender>(begun)[0].padded, large.padded);
  EXPECT_THAT(All<ResumeRender>(Rendered(All<StartRender>(begun)[0])), ElementsAre(Resumes(large)));
}

TEST_F(RenderTurnsTest, ARenderWaitsWhereThereIsNoRoomForWhatItDerivesBesideAnother) {
  const GroupAssignment frame = Sized(1, 7);
  const Box padded = PaddedBox(frame.group.placements.at(0).box, frame.setup);
  const std::uint64_t images = GroupImageBytes(frame.setup, frame.group.placements) + PictureBytes(frame.setup);
  WorkerConfig config = Config();
  config.memory_bytes = kIdleMemoryBytes + 2 * images + std::uint64_t(padded.voxel_count()) * 3 / 2;
  Start(config);
  const StartRender first = All<StartRender>(Assign(frame)).at(0);
  now += std::chrono::seconds(1);
  const Actions same = Assign(Sized(2, 7));
  EXPECT_THAT(All<PauseRender>(same), IsEmpty());
  EXPECT_THAT(All<StartRender>(same), IsEmpty());
  EXPECT_THAT(All<StartRender>(Rendered(first)), SizeIs(1));
}

// Each makes data and an image of its own. One after the other they go on, whatever is missing.
TEST_F(RenderTurnsTest, NoneBeginsBesideAnotherWhileTheProcessHoldsTooMuch) {
  std::int64_t spare = -std::int64_t{1} << 30;
  WorkerConfig config = Config();
  config.memory_bytes = std::uint64_t{1} << 32;
  config.spare_for_images = [&spare] { return spare; };
  Start(config);
  const StartRender first = All<StartRender>(Assign(Sized(1))).at(0);
  EXPECT_THAT(All<StartRender>(Assign(Sized(2))), IsEmpty());
  EXPECT_THAT(All<StartRender>(After(std::chrono::seconds(3))), IsEmpty());
  const auto second = All<StartRender>(Feed(Rendered(first)));
  ASSERT_THAT(second, SizeIs(1));
  EXPECT_EQ(second[0].client, 2U);
  EXPECT_THAT(All<StartRender>(Assign(Sized(3))), IsEmpty());
  spare = std::int64_t{1} << 30;
  EXPECT_THAT(All<StartRender>(Feed(After(std::chrono::seconds(1)))), SizeIs(1)) << "there is room again";
}

TEST_F(RenderTurnsTest, ARenderThatPausesCanBeCancelled) {
  const StartRender large = All<StartRender>(Assign(FrameOf(1, 1))).at(0);
  now += std::chrono::seconds(1);
  const StartRender small = All<StartRender>(Assign(FrameOf(2, 2))).at(0);
  const Actions dropped = Tell(Ping{kEpoch, 0, {1}});
  EXPECT_THAT(All<CancelRender>(dropped), ElementsAre(testing::Field(&CancelRender::image, large.image)));
  EXPECT_THAT(All<ReleaseImage>(Rendered(large, Status::Cancelled("render"))),
              ElementsAre(testing::Field(&ReleaseImage::image, large.image)));
  EXPECT_THAT(All<ResumeRender>(Rendered(small)), IsEmpty());
  EXPECT_EQ(machine->sizes().renders, 0U);
}

TEST_F(RenderTurnsTest, ARenderMayBeDoneBeforeItHearsOfItsPause) {
  const StartRender large = All<StartRender>(Assign(FrameOf(1, 1))).at(0);
  now += std::chrono::seconds(1);
  const StartRender small = All<StartRender>(Assign(FrameOf(2, 2))).at(0);
  EXPECT_THAT(Sent<GroupDone>(Rendered(large)), SizeIs(1));
  EXPECT_THAT(All<ResumeRender>(Rendered(small)), IsEmpty());
  EXPECT_EQ(machine->sizes().renders, 0U);
}

// Renders by chance, from 1 ms to 2 s. Whenever two clients both have something to render, they get the same time.
TEST_F(RenderTurnsTest, ClientsGetTheSameTime) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  constexpr ClientId kClients = 4;
  FrameId frame = 0;
  std::map<ClientId, Duration> longest, used;
  std::map<ImageHandle, std::pair<StartRender, Duration>> left;
  std::optional<ImageHandle> runs;
  const auto take_in = [&](const Actions& actions) {
    for (const WorkerAction& action : actions) {
      if (const auto* start = std::get_if<StartRender>(&action)) {
        EXPECT_FALSE(runs) << "two renders go on";
        runs = start->image;
        left[start->image] = {*start, longest[start->client] * random.Integer(1, 100) / 100};
      } else if (const auto* pause = std::get_if<PauseRender>(&action)) {
        EXPECT_EQ(runs, pause->image);
        runs.reset();
      } else if (const auto* resume = std::get_if<ResumeRender>(&action)) {
        EXPECT_FALSE(runs) << "two renders go on";
        runs = resume->image;
      }
    }
  };
  for (ClientId client = 1; client <= kClients; ++client) {
    longest[client] = std::chrono::milliseconds(client == 1 ? 2000 : random.Integer(1, 100));
    take_in(Assign(FrameOf(client, ++frame)));
    take_in(Assign(FrameOf(client, ++frame)));
  }
  const Time begin = now;
  while (now < begin + std::chrono::seconds(20)) {
    ASSERT_TRUE(runs) << "nobody renders";
    auto& [render, rest] = left.at(*runs);
    const Duration step = std::min(rest, std::max(machine->NextWake() - now, Duration::zero()));
    now += step;
    rest -= step;
    used[render.client] += step;
    if (rest > Duration::zero()) {
      take_in(Tell(Tick{}));
      continue;
    }
    const StartRender ended = render;
    left.erase(ended.image);
    runs.reset();
    take_in(Rendered(ended));
    take_in(Assign(FrameOf(ended.client, ++frame)));
    if (now - begin > std::chrono::seconds(1)) {
      Duration least = Duration::max(), most{};
      for (const auto& [client, of_client] : used) {
        least = std::min(least, of_client);
        most = std::max(most, of_client);
      }
      ASSERT_LE(most - least, 4 * RenderQueue::kTurn);
    }
    Tell(Ping{kEpoch, 0, {}});  // the coordinator is alive
  }
}

}  // namespace
}  // namespace slabstream
