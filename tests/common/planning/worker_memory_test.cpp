// What frames take of workers, and whom they fit.
#include "common/planning/worker_memory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/planning/frame_window.h"
#include "common/volume/memory_budget.h"
#include "tests/common/planning/plan_support.h"
#include "tests/support/random.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

constexpr std::uint64_t kMebi = 1 << 20;

FramePlan PlanOf(int side, int workers, const VolumeSummary& summary, const std::string& renderer = "raycast") {
  FrameRequest request = SomeRequest();
  request.renderer = renderer;
  request.size = {side, side};
  request.view.zoom = 4;  // the volume fills the frame, and no picture is minified
  return Plan(request, summary, FullRoster(workers));
}

TEST(WorkerMemory, AFrameOfOneBoxTakesFourImages) {
  const FramePlan plan = PlanOf(1024, 1, FullSummary({64, 64, 64}));
  constexpr std::uint64_t kImage = 16 * kMebi;
  ASSERT_EQ(std::uint64_t(FrameBytes(plan.setup)), kImage);
  EXPECT_EQ(GroupImageBytes(plan.setup, plan.groups[0].placements), 2 * kImage) << "rendered, and on its way";
  EXPECT_EQ(PictureBytes(plan.setup), 2 * kImage) << "accumulated, and encoded";
}

TEST(WorkerMemory, BricksOfOneValueTakeNothing) {
  VolumeSummary summary = FullSummary({64, 64, 64});
  const Box all = summary.description.geometry.bounds();
  EXPECT_EQ(VoxelBytes(all, summary, 1), 2U * 64 * 64 * 64);
  summary.bricks[0] = {7, 7};
  EXPECT_EQ(VoxelBytes(all, summary, 1), 2U * (64 * 64 * 64 - 16 * 16 * 16));
  EXPECT_EQ(VoxelBytes({{8, 8, 8}, {24, 16, 16}}, summary, 1), 2U * 8 * 8 * 8) << "half of the box lies in the brick of one value";
  EXPECT_EQ(VoxelBytes({}, summary, 1), 0U);
  const std::uint64_t without = VoxelBytes({{0, 0, 0}, {16, 64, 64}}, summary, 1);
  summary.cells.assign(summary.bricks.size(), 100);
  EXPECT_EQ(VoxelBytes({{0, 0, 0}, {16, 64, 64}}, summary, 1), without + std::uint64_t{80} * 100 * 16)
      << "those of the bricks that it touches";
}

TEST(WorkerMemory, EachFrameWithShapesTakesTheirFragments) {
  const VolumeSummary summary = FullSummary({64, 64, 64});
  FramePlan plan = PlanOf(1024, 2, summary);
  EXPECT_EQ(TileBytes(plan.setup), 0U);
  const std::vector<WorkerLimit> limits = {{1, 1 << 30}, {2, 1 << 30}};
  const int without = FramesThatFit(plan, summary, limits).value();
  plan.setup.shapes.resize(1);
  EXPECT_EQ(TileBytes(plan.setup), 48U * 1024 * 1024);
  EXPECT_LT(FramesThatFit(plan, summary, limits).value(), without);
}

TEST(WorkerMemory, LightOfOtherFieldsTakesSamplesAndTheirExtinction) {
  FrameSetup setup = PlanOf(64, 1, FullSummary({64, 64, 64})).setup;
  EXPECT_EQ(SharedBytes(setup), 0U);
  const auto light_of = [](const Index3& size, ScalarType type) { return CoarserLevel{7, {.geometry = {size}, .type = type}}; };
  setup.light = light_of({64, 64, 64}, ScalarType::kUint8);
  const std::uint64_t alone = SharedBytes(setup);
  EXPECT_GT(alone, 64U * 64 * 64);
  setup.fields.resize(2);
  setup.fields[0].light = light_of({128, 10, 1}, ScalarType::kUint16);
  setup.fields[1].light = light_of({5, 5, 5}, ScalarType::kFloat32);
  EXPECT_EQ(SharedBytes(setup), alone + 128U * 10 * (2 + 4) + 5U * 5 * 5 * (4 + 4));
}

TEST(WorkerMemory, TheSmallestWorkerWithAPartDecides) {
  const VolumeSummary summary = FullSummary({64, 64, 64});
  const FramePlan plan = PlanOf(1024, 2, summary);
  const auto fit = [&](std::uint64_t first, std::uint64_t second, std::uint64_t stranger = 0) {
    return FramesThatFit(plan, summary, std::vector<WorkerLimit>{{1, first}, {2, second}, {3, stranger}});
  };
  const std::uint64_t images = GroupImageBytes(plan.setup, plan.groups[0].placements) + PictureBytes(plan.setup);
  const std::uint64_t one = kIdleMemoryBytes + 2 * kMebi + images;
  EXPECT_EQ(*fit(0, 0), kMostInWindow) << "without limits everything fits";
  EXPECT_EQ(*fit(one, 0), 1);
  EXPECT_EQ(*fit(one + images, one + 2 * images), 2);
  EXPECT_EQ(*fit(one + 2 * images, one + 2 * images, kMebi), 3) << "who has no part does not count";
  const Status refused = fit(one, images).status();
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(refused.message(), HasSubstr("size 1024x1024 needs "));
  EXPECT_THAT(refused.message(), HasSubstr(" of worker 2, limit " + MemoryText(images)));
}

TEST(WorkerMemory, VoxelsThatDoNotFitAreNamedAsTheDataset) {
  const VolumeSummary summary = FullSummary({512, 512, 512});
  const FramePlan plan = PlanOf(64, 1, summary);
  const Status refused = FramesThatFit(plan, summary, std::vector<WorkerLimit>{{1, 256 * kMebi}}).status();
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(refused.message(), HasSubstr("the dataset needs 449 MiB of worker 1, limit 256 MiB (voxels 256 MiB"));
}

// A frame along slices, or a finer one, is as large as it is, not as its picture.
TEST(WorkerMemory, NamesTheSizeThatIsRendered) {
  const VolumeSummary summary = FullSummary({64, 64, 64});
  const FramePlan plan = PlanOf(1024, 1, summary, "splat");
  const Status refused = FramesThatFit(plan, summary, std::vector<WorkerLimit>{{1, kMebi}}).status();
  EXPECT_THAT(refused.message(), testing::ContainsRegex("size 1024x1024 \\(rendered as [0-9]+x[0-9]+\\) needs "));
}

TEST(WorkerMemory, TwoBoxesOfAFrameFitAWorkerBesideItsImages) {
  const VolumeSummary summary = FullSummary({64, 64, 64});
  const FramePlan plan = PlanOf(512, 1, summary);
  FrameSetup four = plan.setup;
  for (DatasetId field = 1; field < 4; ++field) four.fields.push_back({.levels = {{field, summary.description, {}}}, .of_volume = {0}});
  for (const std::uint64_t limit : {std::uint64_t{0}, 8192 * kMebi}) {
    EXPECT_EQ(BoxBytesFor(plan.setup, limit), kBoxBytesTarget);
    EXPECT_EQ(BoxBytesFor(four, limit), kBoxBytesTarget) << "fields that come and go cut no box anew";
  }
  std::int64_t before = 0;
  for (std::uint64_t limit = 300 * kMebi; limit < 4096 * kMebi; limit += 17 * kMebi + 1) {
    for (const bool stored : {false, true}) {
      FrameSetup setup = limit % 2 == 0 ? plan.setup : four;
      if (stored) setup.stored = StoredAt{};
      const std::int64_t bytes = BoxBytesFor(setup, limit);
      ASSERT_GT(bytes, 0);
      ASSERT_LE(bytes, kBoxBytesTarget);
      if (bytes == kBoxBytesTarget) continue;
      // Boxes that are cut for memory are small, and so are their images.
      const std::uint64_t images = std::uint64_t(FrameBytes(setup)) / 2 + PictureBytes(setup);
      const double derived = stored ? setup.renderer->derived_from_stored() : 1;  // of the box that is rendered
      const auto boxes = std::uint64_t((2 + derived) * double(bytes) * double(1 + setup.fields.size()));
      EXPECT_LE(kIdleMemoryBytes + (stored ? SourceBytes(limit) : 0) + boxes + images, limit);
      if (!stored && setup.fields.empty()) {
        EXPECT_GE(bytes, before) << "more memory, larger boxes";
        before = bytes;
      }
    }
  }
  EXPECT_GT(before, 0);
}

// The cells of a grid count, not only the voxels of its lattice: boxes are as many as they need.
TEST(WorkerMemory, BoxesOfAGridFitAWorkerWithTheirCells) {
  Random random(8);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 20; ++round) {
    VolumeSummary summary = FullSummary({128, 96, 80});
    for (std::size_t brick = 0; brick < summary.bricks.size(); ++brick) summary.cells.push_back(std::uint32_t(random.Integer(0, 20'000)));
    const int workers = random.Integer(1, 5);
    const std::uint64_t limit = std::uint64_t(random.Integer(220, 2000)) * kMebi;
    SCOPED_TRACE(testing::Message() << workers << " workers of " << (limit >> 20) << " MiB");
    FrameRequest request = SomeRequest();
    request.renderer = "slice";
    request.policy.decomposition = "subcube";
    request.policy.groups = 0;
    const std::int64_t target = BoxBytesFor(Plan(request, summary, FullRoster(workers)).setup, limit);
    const FramePlan plan = PlanFrame(request, 1, summary, FullRoster(workers), target).value();
    const Box whole = summary.description.geometry.bounds();
    EXPECT_TRUE(plan.groups.size() > 1 || whole.voxel_count() + BoxBytesOfCells(whole, summary) <= target * workers);
    std::vector<WorkerLimit> limits;
    for (int worker = 1; worker <= workers; ++worker) limits.push_back({WorkerId(worker), limit});
    const Result<int> fit = FramesThatFit(plan, summary, limits);
    EXPECT_TRUE(fit.ok()) << fit.status().message();
  }
}

}  // namespace
}  // namespace slabstream
