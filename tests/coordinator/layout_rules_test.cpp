// What the machine does about layouts: counts occupied voxels where a policy needs them, keeps layouts while views change, and lets them
// follow render times where balance is dynamic.
#include "tests/coordinator/coordinator_script.h"

namespace slabstream {
namespace {

constexpr PeerToken kClient = 500;

SubmitFrame KdFrame(RequestId request, const std::string& balance = "static") {
  SubmitFrame submit = Frame(request);
  submit.frame.policy.decomposition = "kd-tree";
  submit.frame.policy.balance = balance;
  submit.frame.view.azimuth_degrees = double(request) * 30;
  return submit;
}

// All of BlockSummary().
std::shared_ptr<const OccupancyGrid> FullGrid() {
  return std::make_shared<const OccupancyGrid>(OccupancyGrid{{32, 32, 48}, std::vector<std::uint16_t>(4 * 4 * 6, 512)});
}

std::vector<Box> Boxes(const Actions& actions) {
  std::vector<Box> boxes;
  for (const GroupAssignment& group : HandedOut(actions)) {
    for (const Placement& placement : group.group.placements) boxes.push_back(placement.box);
  }
  std::sort(boxes.begin(), boxes.end());
  return boxes;
}

// Render times by where a box begins: the lower half of z costs `ratio` times as much a slice.
std::vector<RankReport> Reports(const GroupAssignment& group, double ratio) {
  std::vector<RankReport> reports;
  for (std::size_t rank = 0; rank < group.group.placements.size(); ++rank) {
    const Placement& placement = group.group.placements[rank];
    const Box lower = Intersection(placement.box, {{0, 0, 0}, {32, 32, 24}});
    RankReport report{.worker = placement.worker, .group = group.key.group, .rank = std::uint32_t(rank), .box = placement.id};
    const double voxels = double(placement.box.voxel_count() - lower.voxel_count()) + ratio * double(lower.voxel_count());
    report.stage_ns[std::size_t(Stage::kPrepare)] = 5'000'000'000;  // once, and so no cost of the next frame
    report.stage_ns[std::size_t(Stage::kRender)] = 5'000'000'000 + std::int64_t(voxels * 1000);
    reports.push_back(report);
  }
  return reports;
}

TEST(CoordinatorLayouts, CountsOnceADatasetAndTransferFunction) {
  CoordinatorScript script;
  script.Join(11, 1);
  EXPECT_TRUE(HandedOut(script.Submit(kClient, KdFrame(1))).empty());
  ASSERT_EQ(script.counts.size(), 1U);
  EXPECT_TRUE(HandedOut(script.Submit(kClient, KdFrame(2))).empty());
  EXPECT_EQ(script.counts.size(), 1U) << "the same voxels are counted twice";
  // A frame that needs no count does not wait.
  EXPECT_EQ(HandedOut(script.Submit(kClient, Frame(3))).size(), 1U);

  const Actions counted = script.Step(OccupiedCounted{script.counts[0].count, FullGrid()});
  EXPECT_FALSE(HandedOut(counted).empty());
  EXPECT_TRUE(HandedOut(script.Step(OccupiedCounted{script.counts[0].count, FullGrid()})).empty());  // twice
  EXPECT_TRUE(HandedOut(script.Step(OccupiedCounted{4711, FullGrid()})).empty());                    // nobody's

  SubmitFrame other = KdFrame(4);
  other.frame.transfer.choice = TransferFunction{.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 0.25}}};
  script.Submit(kClient, other);
  EXPECT_EQ(script.counts.size(), 2U);
}

TEST(CoordinatorLayouts, AFailedCountFailsWhatWaitsForItAndIsTriedAgain) {
  CoordinatorScript script;
  script.Join(11, 1);
  script.Submit(kClient, KdFrame(1));
  script.Submit(kClient, KdFrame(2));
  ASSERT_EQ(script.counts.size(), 1U);
  const OccupiedCounted failure{script.counts[0].count, Status::ResourceExhausted("not enough memory")};
  const auto failed = ToClients<FrameFailed>(script.Step(failure));
  ASSERT_EQ(failed.size(), 2U);
  EXPECT_EQ(failed[0].message.status, Status::ResourceExhausted("not enough memory"));
  EXPECT_TRUE(ToClients<FrameFailed>(script.Step(failure)).empty());
  EXPECT_EQ(script.QueryStatus().queued, 0U);

  script.Submit(kClient, KdFrame(3));
  ASSERT_EQ(script.counts.size(), 2U);
  EXPECT_TRUE(ToClients<FrameFailed>(script.Step(failure)).empty());  // of the first count
  EXPECT_FALSE(HandedOut(script.Step(OccupiedCounted{script.counts[1].count, FullGrid()})).empty());
}

TEST(CoordinatorLayouts, ACountThatNeverEndsMeetsTheDeadline) {
  CoordinatorScript script;
  script.Join(11, 1);
  SubmitFrame submit = KdFrame(1);
  submit.deadline_ms = 3000;
  script.Submit(kClient, submit);
  const auto failed = ToClients<FrameFailed>(script.Pass(seconds(4)));
  ASSERT_EQ(failed.size(), 1U);
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kDeadlineExceeded);
  EXPECT_NE(failed[0].message.status.message().find("being counted"), std::string::npos) << failed[0].message.status.message();
}

TEST(CoordinatorLayouts, ManyTransferFunctionsAreCountedInTurnAndAllServed) {
  CoordinatorScript script;
  script.Join(11, 1);
  const int requests = int(OccupancyTable::kMaxKept) * 3;
  for (int i = 1; i <= requests; ++i) {
    SubmitFrame submit = KdFrame(RequestId(i));
    submit.frame.transfer.choice = TransferFunction{.colors = {{0, {1, 1, 1}}}, .opacities = {{0, i / 100.0}}};
    ASSERT_TRUE(ToClients<FrameFailed>(script.Submit(kClient, submit)).empty());
  }
  int replies = 0;
  for (std::size_t i = 0; i < script.counts.size(); ++i) {
    replies += int(ToClients<FrameReply>(script.AnswerAll(script.Step(OccupiedCounted{script.counts[i].count, FullGrid()}))).size());
  }
  EXPECT_EQ(replies, requests);
  EXPECT_EQ(script.counts.size(), std::size_t(requests));
}

class BalanceScript : public CoordinatorScript {
 public:
  BalanceScript() {
    for (PeerToken worker = 11; worker < 15; ++worker) Join(worker, worker);
  }
  // The boxes of a frame that takes its time as Reports says.
  std::vector<Box> Play(const SubmitFrame& submit, double ratio) {
    const std::size_t counted = counts.size();
    Actions actions = Submit(kClient, submit);
    if (counts.size() > counted) Append(actions, Step(OccupiedCounted{counts.back().count, FullGrid()}));
    for (const GroupAssignment& group : HandedOut(actions)) {
      Append(actions, Done(group, Reports(group, ratio)));
      Append(actions, Image(group, group.group_count));
    }
    EXPECT_EQ(ToClients<FrameReply>(actions).size(), 1U);
    return Boxes(actions);
  }
};

TEST(CoordinatorLayouts, StaticOnesStay) {
  BalanceScript script;
  const std::vector<Box> first = script.Play(KdFrame(1), 10);
  for (RequestId request = 2; request < 8; ++request) EXPECT_EQ(script.Play(KdFrame(request), 10), first);
}

TEST(CoordinatorLayouts, DynamicOnesFollowRenderTimesAndThenStay) {
  BalanceScript script;
  const std::vector<Box> first = script.Play(KdFrame(1, "dynamic"), 10);
  const std::vector<Box> second = script.Play(KdFrame(2, "dynamic"), 10);
  EXPECT_NE(second, first);
  for (RequestId request = 3; request < 6; ++request) script.Play(KdFrame(request, "dynamic"), 10);
  const std::vector<Box> settled = script.Play(KdFrame(6, "dynamic"), 10);
  for (RequestId request = 7; request < 10; ++request) EXPECT_EQ(script.Play(KdFrame(request, "dynamic"), 10), settled);
  EXPECT_LT(settled[0].size().z, first[0].size().z);  // the costly half is shared by more
}

TEST(CoordinatorLayouts, SplitByCostIsMadeAnewOnceCostsAreKnown) {
  BalanceScript script;
  const auto frame = [](RequestId request) {
    SubmitFrame submit = Frame(request);
    submit.frame.policy.split = "cost";
    return submit;
  };
  const std::vector<Box> first = script.Play(frame(1), 10), second = script.Play(frame(2), 10);
  EXPECT_NE(second, first);
  EXPECT_LT(second[0].size().z, first[0].size().z);
  for (RequestId request = 3; request < 6; ++request) EXPECT_EQ(script.Play(frame(request), 10), second);
}

TEST(CoordinatorLayouts, AnotherNumberOfWorkersIsAnotherLayout) {
  BalanceScript script;
  EXPECT_EQ(script.Play(KdFrame(1), 1).size(), 4U);
  script.Join(15, 15);
  EXPECT_EQ(script.Play(KdFrame(2), 1).size(), 5U);
}

}  // namespace
}  // namespace slabstream
