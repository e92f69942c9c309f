// What the machine does about layouts: counts occupied voxels where a policy needs them, keeps layouts while views
// change, and lets them follow render times where balance is dynamic.
#include "tests/coordinator/coordinator_script.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

constexpr PeerToken kFarClient = 500;  // beyond the tokens of many workers

SubmitFrame KdFrame(RequestId request, const std::string& balance = "static") {
  SubmitFrame submit = Frame(request);
  submit.frame.policy.decomposition = "kd-tree";
  submit.frame.policy.balance_by = "occupied";
  submit.frame.policy.balance = balance;
  submit.frame.view.azimuth_degrees = double(request) * 30;
  return submit;
}

// All of BlockSummary().
std::shared_ptr<const OccupancyGrid> FullGrid() {
  return std::make_shared<const OccupancyGrid>(
      OccupancyGrid{{32, 32, 48}, std::vector<CellOccupancy>(4 * 4 * 6, FullCell({{0, 0, 0}, {8, 8, 8}}))});
}

std::vector<Box> Boxes(const Actions& actions) {
  std::vector<Box> boxes;
  for (const GroupAssignment& group : HandedOut(actions)) {
    for (const Placement& placement : group.group.placements) boxes.push_back(placement.box);
  }
  std::sort(boxes.begin(), boxes.end());
  return boxes;
}

struct Once {
  std::int64_t fetch_ns = 0, prepare_ns = 5'000'000;
};

// Render times by where a box begins: the lower half of z costs `ratio` times as much a slice. `once`: beside them, of each box.
std::vector<RankReport> Reports(const GroupAssignment& group, double ratio, const Once& once = {}) {
  std::vector<RankReport> reports;
  for (std::size_t rank = 0; rank < group.group.placements.size(); ++rank) {
    const Placement& placement = group.group.placements[rank];
    const Box lower = Intersection(placement.box, {{0, 0, 0}, {32, 32, 24}});
    RankReport report{.worker = placement.worker, .group = group.key.group, .rank = std::uint32_t(rank), .box = placement.id};
    const double voxels = double(placement.box.voxel_count() - lower.voxel_count()) + ratio * double(lower.voxel_count());
    report.stage_ns[std::size_t(Stage::kFetch)] = once.fetch_ns;
    if (once.fetch_ns > 0) report.voxel_bytes = std::uint64_t(placement.box.voxel_count());
    report.stage_ns[std::size_t(Stage::kPrepare)] = once.prepare_ns;  // no cost of the next frame
    report.stage_ns[std::size_t(Stage::kRender)] = once.prepare_ns + std::int64_t(voxels * 1000);
    reports.push_back(report);
  }
  return reports;
}

TEST(CoordinatorLayouts, CountsOnceADatasetAndTransferFunction) {
  CoordinatorScript script;
  script.Join(11, 1);
  EXPECT_TRUE(HandedOut(script.Submit(kFarClient, KdFrame(1))).empty());
  ASSERT_EQ(script.counts.size(), 1U);
  EXPECT_TRUE(HandedOut(script.Submit(kFarClient, KdFrame(2))).empty());
  EXPECT_EQ(script.counts.size(), 1U) << "the same voxels are counted twice";
  // A frame that needs no count does not wait.
  EXPECT_EQ(HandedOut(script.Submit(kFarClient, Frame(3))).size(), 1U);

  const Actions counted = script.Step(OccupiedCounted{script.counts[0].count, FullGrid()});
  EXPECT_FALSE(HandedOut(counted).empty());
  EXPECT_TRUE(HandedOut(script.Step(OccupiedCounted{script.counts[0].count, FullGrid()})).empty());  // twice
  EXPECT_TRUE(HandedOut(script.Step(OccupiedCounted{4711, FullGrid()})).empty());                    // nobody's

  SubmitFrame other = KdFrame(4);
  other.frame.transfer.choice = TransferFunction{.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 0.25}}};
  script.Submit(kFarClient, other);
  EXPECT_EQ(script.counts.size(), 2U);
}

TEST(CoordinatorLayouts, AFailedCountFailsWhatWaitsForItAndIsTriedAgain) {
  CoordinatorScript script;
  script.Join(11, 1);
  script.Submit(kFarClient, KdFrame(1));
  script.Submit(kFarClient, KdFrame(2));
  ASSERT_EQ(script.counts.size(), 1U);
  const OccupiedCounted failure{script.counts[0].count, Status::ResourceExhausted("not enough memory")};
  const auto failed = ToClients<FrameFailed>(script.Step(failure));
  ASSERT_EQ(failed.size(), 2U);
  EXPECT_EQ(failed[0].message.status, Status::ResourceExhausted("not enough memory"));
  EXPECT_TRUE(ToClients<FrameFailed>(script.Step(failure)).empty());
  EXPECT_EQ(script.QueryStatus().queued, 0U);

  script.Submit(kFarClient, KdFrame(3));
  ASSERT_EQ(script.counts.size(), 2U);
  EXPECT_TRUE(ToClients<FrameFailed>(script.Step(failure)).empty());  // of the first count
  EXPECT_FALSE(HandedOut(script.Step(OccupiedCounted{script.counts[1].count, FullGrid()})).empty());
}

TEST(CoordinatorLayouts, ACountThatNeverEndsMeetsTheDeadline) {
  CoordinatorScript script;
  script.Join(11, 1);
  SubmitFrame submit = KdFrame(1);
  submit.deadline_ms = 3000;
  script.Submit(kFarClient, submit);
  const auto failed = ToClients<FrameFailed>(script.Pass(seconds(4)));
  ASSERT_EQ(failed.size(), 1U);
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kDeadlineExceeded);
  EXPECT_NE(failed[0].message.status.message().find("being counted"), std::string::npos) << failed[0].message.status.message();
}

TEST(CoordinatorLayouts, WhatEachRendererDrawsIsCountedOnce) {
  CoordinatorScript script;
  script.Join(11, 1);
  std::vector<ClassificationTable> tables;
  RequestId request = 0;
  for (const RendererKind* renderer : {Splatting(), ZBuffer(), Splatting()}) {
    SubmitFrame submit = KdFrame(++request);
    submit.frame.renderer = renderer->name();
    submit.frame.transfer.choice = TransferFunction{.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 0.1}, {255, 1}}};
    const std::size_t counted = script.counts.size();
    Actions actions = script.Submit(kFarClient, submit);
    if (script.counts.size() > counted) {
      const CountDataset& count = script.counts.back();
      tables.push_back(count.volume.renderer()->DrawnTable(count.volume.transfer(), *count.summary));
      actions = script.Step(OccupiedCounted{script.counts.back().count, FullGrid()});
    }
    EXPECT_EQ(ToClients<FrameReply>(script.AnswerAll(actions)).size(), 1U);
  }
  ASSERT_EQ(tables.size(), 2U);
  const auto drawn = [](const ClassificationTable& table) { return std::ranges::count_if(table.opacity, [](float a) { return a > 0; }); };
  EXPECT_GT(drawn(tables[0]), drawn(tables[1])) << "the Z-buffer draws what is opaque";
}

TEST(CoordinatorLayouts, ManyTransferFunctionsAreCountedInTurnAndAllServed) {
  CoordinatorScript script;
  script.Join(11, 1);
  const int requests = int(OccupancyTable::kMaxKept) * 3;
  for (int i = 1; i <= requests; ++i) {
    SubmitFrame submit = KdFrame(RequestId(i));
    submit.frame.transfer.choice = TransferFunction{.colors = {{0, {1, 1, 1}}}, .opacities = {{0, i / 100.0}}};
    ASSERT_TRUE(ToClients<FrameFailed>(script.Submit(kFarClient, submit)).empty());
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
  std::vector<Box> Play(const SubmitFrame& submit, double ratio, const Once& once = {}) {
    const std::size_t counted = counts.size();
    Actions actions = Submit(kFarClient, submit);
    if (counts.size() > counted) Append(actions, Step(OccupiedCounted{counts.back().count, FullGrid()}));
    for (const GroupAssignment& group : HandedOut(actions)) {
      Append(actions, Done(group, Reports(group, ratio, once)));
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
  EXPECT_EQ(script.Play(KdFrame(2, "dynamic"), 10), first) << "one frame does not tell how much times scatter";
  EXPECT_NE(script.Play(KdFrame(3, "dynamic"), 10), first);
  for (RequestId request = 4; request < 6; ++request) script.Play(KdFrame(request, "dynamic"), 10);
  const std::vector<Box> settled = script.Play(KdFrame(6, "dynamic"), 10);
  for (RequestId request = 7; request < 10; ++request) EXPECT_EQ(script.Play(KdFrame(request, "dynamic"), 10), settled);
  EXPECT_LT(settled[0].voxel_count(), first[0].voxel_count());  // the costly half is shared by more
}

TEST(CoordinatorLayouts, DynamicOnesStayWhereMovingVoxelsHasCostMoreThanItSaves) {
  constexpr std::int64_t kLong = 100'000'000'000;
  for (const Once& first_time : {Once{.fetch_ns = kLong}, Once{.prepare_ns = kLong}}) {
    SCOPED_TRACE(testing::Message() << first_time.fetch_ns << " ns to fetch, " << first_time.prepare_ns << " to prepare");
    BalanceScript script;
    const std::vector<Box> first = script.Play(KdFrame(1, "dynamic"), 10, first_time);
    // Renderers charge a moment to what they find done already.
    for (RequestId request = 2; request < 20; ++request) EXPECT_EQ(script.Play(KdFrame(request, "dynamic"), 10, {.prepare_ns = 1}), first);
  }
}

TEST(CoordinatorLayouts, SplitByCostIsMadeAnewOnceCostsAreKnown) {
  BalanceScript script;
  const auto frame = [](RequestId request) {
    SubmitFrame submit = Frame(request);
    submit.frame.policy.balance_by = "cost";
    return submit;
  };
  const std::vector<Box> first = script.Play(frame(1), 10), second = script.Play(frame(2), 10);
  EXPECT_NE(second, first);
  EXPECT_LT(second[0].size().z, first[0].size().z);
  for (RequestId request = 3; request < 6; ++request) EXPECT_EQ(script.Play(frame(request), 10), second);
}

// As a client asks that names nothing.
SubmitFrame UsualFrame(RequestId request) {
  SubmitFrame submit = Frame(request, 0);
  submit.frame.policy = {};
  submit.frame.view.azimuth_degrees = double(request) * 30;
  return submit;
}

TEST(CoordinatorLayouts, WithoutAPolicyNothingIsCounted) {
  CoordinatorScript script;
  script.Join(21, 21);
  const std::vector<GroupAssignment> begun = HandedOut(script.Submit(kFarClient, UsualFrame(1)));
  ASSERT_EQ(begun.size(), 1U) << "it waits for something";
  EXPECT_TRUE(script.counts.empty());
  const auto replies = ToClients<FrameReply>(script.AnswerAll(script.Answer(begun[0])));
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies[0].message.statistics.decomposition, "kd-tree");
  EXPECT_EQ(replies[0].message.statistics.balance_by, "bricks");
  EXPECT_EQ(replies[0].message.statistics.combine, "fan-in");
}

TEST(CoordinatorLayouts, ALookThatChangesLittleMovesNoBoxes) {
  BalanceScript script;
  const std::vector<Box> first = script.Play(UsualFrame(1), 1);
  SubmitFrame clearer = UsualFrame(2);
  clearer.frame.transfer.opacity_distance = 2;
  EXPECT_EQ(script.Play(clearer, 1), first);
  SubmitFrame clipped = UsualFrame(3);  // the upper half of it
  clipped.frame.clipping.box = ClipBox{{-100, -100, 24}, {100, 100, 100}};
  EXPECT_NE(script.Play(clipped, 1), first) << "half of the workers would have nothing to do";
}

TEST(CoordinatorPolicies, AnUnknownNameFails) {
  CoordinatorScript script;
  script.Join(21, 21);
  RequestId request = 0;
  for (const char* name : {"teleport", "auto"}) {
    SubmitFrame submit = UsualFrame(++request);
    submit.frame.policy.combine = name;
    const auto failed = ToClients<FrameFailed>(script.Submit(kFarClient, submit));
    ASSERT_EQ(failed.size(), 1U);
    EXPECT_EQ(failed[0].message.status.code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(failed[0].message.status.message(), testing::AllOf(testing::HasSubstr(name), testing::HasSubstr("fan-in")));
  }
}

TEST(CoordinatorLayouts, AnotherNumberOfWorkersIsAnotherLayout) {
  BalanceScript script;
  EXPECT_EQ(script.Play(KdFrame(1), 1).size(), 4U);
  script.Join(15, 15);
  EXPECT_EQ(script.Play(KdFrame(2), 1).size(), 5U);
}

}  // namespace
}  // namespace slabstream
