// Layouts of volumes that nobody holds: boxes that fit a target, and end near the blocks in which the source is read.
#include <gtest/gtest.h>

#include <array>

#include "common/planning/worker_memory.h"
#include "common/renderers/registry.h"
#include "common/renderers/renderer_kind.h"
#include "tests/common/planning/plan_support.h"

namespace slabstream {
namespace {

VolumeSummary StoredSummary(const Index3& size, const Index3& block) {
  VolumeSummary summary = FullSummary(size);
  summary.stored = StoredAt{.source = "/data/scan.ome.zarr", .block = {{0, 0, 0}, block}};
  return summary;
}

std::int64_t PaddedVoxels(const FramePlan& plan, const Box& box) { return PaddedBox(box, plan.setup).voxel_count(); }

TEST(StoredLayout, BoxesTileTheVolumeAndFitTheTarget) {
  Random random(61);
  SCOPED_TRACE(random.trace());
  constexpr std::int64_t kTarget = 1 << 20;
  for (int round = 0; round < 40; ++round) {
    const Index3 size = {random.Integer(1, 300), random.Integer(1, 300), random.Integer(1, 300)};
    Index3 block;
    for (const Axis axis : kAxes) block[axis] = std::min(size[axis], 1 << random.Integer(0, 8));
    SCOPED_TRACE(testing::Message() << size.x << "x" << size.y << "x" << size.z << " in blocks of " << block.x << "x" << block.y << "x"
                                    << block.z);
    const VolumeSummary summary = StoredSummary(size, block);
    const Roster roster = FullRoster(random.Integer(1, 5));
    FrameRequest request = SomeRequest();
    request.renderer = random.Chance(0.5) ? "raycast" : "splat";
    request.policy.decomposition = random.Chance(0.5) ? "slab" : "subcube";
    const Result<FramePlan> plan = PlanFrame(request, 7, summary, roster, kTarget);
    ASSERT_TRUE(plan.ok()) << plan.status().message();
    ExpectSound(*plan, roster);
    std::int64_t voxels = 0;
    for (const Box& box : plan->layout->partition.boxes()) {
      ASSERT_LE(PaddedVoxels(*plan, box), kTarget);
      voxels += box.voxel_count();
    }
    EXPECT_EQ(voxels, summary.description.geometry.bounds().voxel_count());
    EXPECT_EQ(plan->setup.stored, summary.stored);
  }
}

TEST(StoredLayout, FewBlocksAreReadForTwoBoxes) {
  constexpr std::int32_t kBlock = 64;
  const VolumeSummary summary = StoredSummary({512, 512, 512}, Uniform(kBlock));
  for (const int workers : {1, 2, 3}) {
    const FramePlan plan = PlanFrame(SomeRequest(), 7, summary, FullRoster(workers), 8 << 20).value();
    std::int64_t read = 0;
    for (const Box& box : plan.layout->partition.boxes()) {
      const Box padded = PaddedBox(box, plan.setup);
      std::int64_t blocks = 1;
      for (const Axis axis : kAxes) blocks *= (padded.end[axis] - 1) / kBlock - padded.begin[axis] / kBlock + 1;
      read += blocks;
      for (const Axis axis : kAxes) {
        if (box.end[axis] == 512) continue;
        EXPECT_EQ(padded.end[axis] % kBlock, 0) << "the halo behind a box is of the box's own blocks";
      }
    }
    EXPECT_GT(plan.layout->partition.boxes().size(), 8U);
    EXPECT_LE(read, 3 * 8 * 8 * 8);
  }
}

TEST(StoredLayout, BoxesThatShowNothingAreNobodys) {
  VolumeSummary summary = StoredSummary({256, 256, 256}, Uniform(32));
  for (std::size_t brick = 0; brick < summary.bricks.size() / 2; ++brick) summary.bricks[brick] = {0, 50};  // z below 128
  const Roster roster = FullRoster(2);
  const FramePlan plan = PlanFrame(SomeRequest(), 7, summary, roster, 1 << 20).value();
  ExpectSound(plan, roster);
  for (std::size_t box = 0; box < plan.layout->owners.size(); ++box) {
    const Box padded = PaddedBox(plan.layout->partition.boxes()[box], plan.setup);
    EXPECT_EQ(plan.layout->owners[box] != kNoSlot, padded.end.z > 128);
  }
}

TEST(StoredLayout, VoxelsThatAreHeldAreCutAsEver) {
  const VolumeSummary held = FullSummary({100, 100, 100});
  const FramePlan plan = Plan(SomeRequest(), held, FullRoster(2));
  EXPECT_FALSE(plan.setup.stored);
  EXPECT_EQ(plan.layout->partition.boxes().size(), 2U);
}

// ---------------------------------------------------------------- with an index

// What an index says of bricks of 16 voxels: `value` for their voxels.
template <class Value>
VolumeSummary Indexed(VolumeSummary summary, const Value& value) {
  auto bricks = std::make_shared<BrickRangeList>();
  for (std::size_t i = 0; i < summary.bricks.size(); ++i) bricks->push_back(value(kBrick * PlaceIn(summary.brick_counts, i)));
  summary.indexed = bricks;
  return summary;
}

constexpr ValueRange kAir = {3, 20}, kBody = {3, 220};

TEST(IndexedLayout, BoxesThatShowNothingAreRenderedByNobody) {
  const VolumeSummary unknown = StoredSummary({512, 256, 256}, Uniform(64));
  const VolumeSummary known = Indexed(unknown, [](const Index3& at) { return at.x < 200 ? kBody : kAir; });
  for (const RendererKind* renderer : Renderers()) {
    if (renderer->Can(Ability::kCells)) continue;
    SCOPED_TRACE(renderer->name());
    FrameRequest request = SomeRequest();
    request.renderer = renderer->name();
    request.policy.decomposition = "subcube";
    const Layout without = *PlanFrame(request, 7, unknown, FullRoster(3), 4 << 20)->layout;
    const Layout with = *PlanFrame(request, 7, known, FullRoster(3), 4 << 20)->layout;
    EXPECT_EQ(with.partition, without.partition) << "boxes are where they would be";
    EXPECT_TRUE(without.filled.empty());
    const bool draws_all = renderer->format() == PixelFormat::kMaximum || renderer->format() == PixelFormat::kSum;
    int dropped = 0;
    for (BoxId box = 0; box < with.owners.size(); ++box) {
      EXPECT_NE(without.owners[box], kNoSlot);
      const bool shows = draws_all || with.partition.boxes()[box].begin.x < 208 + renderer->reach();
      EXPECT_EQ(with.owners[box] != kNoSlot, shows) << "box " << box;
      dropped += shows ? 0 : 1;
    }
    EXPECT_EQ(dropped > 0, !draws_all);
  }
}

TEST(IndexedLayout, OnlyWhatIsFarFromAllThatIsDrawnIsFilled) {
  Random random(62);
  SCOPED_TRACE(random.trace());
  int filled_parts = 0;
  for (int round = 0; round < 20; ++round) {
    const Index3 size = {random.Integer(500, 700), random.Integer(40, 200), random.Integer(40, 200)};
    const Index3 block = {random.Integer(1, 40), random.Integer(1, 40), random.Integer(1, 40)};
    const Axis axis = random.Chance(0.7) ? Axis::kX : Axis::kY;
    std::vector<Box> drawn;
    const VolumeSummary summary = Indexed(StoredSummary(size, Min(block, size)), [&](const Index3& at) {
      if (at[axis] > size[axis] / 2 || random.Chance(0.9)) return ValueRange{float(random.Integer(0, 30)), float(random.Integer(30, 60))};
      drawn.push_back({at, at + Uniform(kBrick)});
      return kBody;
    });
    const FramePlan plan = PlanFrame(SomeRequest(), 7, summary, FullRoster(2), 1 << 20).value();
    const std::int32_t reach = plan.setup.renderer->reach();
    for (const Placement& placement : PlacementsOf(plan)) {
      const Box padded = PaddedBox(placement.at(), plan.setup);
      EXPECT_EQ(placement.filled, plan.layout->filled[placement.id]);
      for (const FilledBox& part : placement.filled) {
        EXPECT_TRUE(padded.Contains(part.box));
        for (const Box& brick : drawn) EXPECT_TRUE(Intersection(Grown(part.box, 2 * reach, padded), brick).empty());
        const ValueRange& range = (*summary.indexed)[NumberIn(
            summary.brick_counts, {part.box.begin.x / kBrick, part.box.begin.y / kBrick, part.box.begin.z / kBrick})];
        EXPECT_EQ(part.sample, range.min) << "a sample of a brick in it";
        ++filled_parts;
      }
    }
  }
  EXPECT_GT(filled_parts, 20);
}

TEST(IndexedLayout, SamplesOfWhatIsFilledAreStoredOnes) {
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}) {
    VolumeSummary summary = StoredSummary({4096, 64, 64}, Uniform(16));
    summary.description.type = type;
    summary.description.mapping = {0.5, -20};
    auto bricks = std::make_shared<BrickRangeList>(summary.bricks.size(), ValueRange{-16.5F, -15.5F});
    bricks->front() = {105, 105};  // the only one that is drawn
    summary.indexed = bricks;
    const FramePlan plan = PlanFrame(SomeRequest(), 7, summary, FullRoster(1)).value();
    const std::vector<Placement> placements = PlacementsOf(plan);
    ASSERT_FALSE(placements.empty());
    EXPECT_FALSE(placements[0].filled.empty());
    for (const FilledBox& part : placements[0].filled) EXPECT_EQ(part.sample, 7);
  }
}

TEST(IndexedLayout, BoxesOfEachLevelOfAPictureAreLeftOut) {
  const VolumeSummary fine = StoredSummary({512, 64, 64}, Uniform(16));
  VolumeSummary coarse = StoredSummary({256, 32, 32}, Uniform(16));
  coarse.description.geometry.spacing = {2, 2, 2};
  coarse.description.geometry.orientation.origin = {0.5, 0.5, 0.5};
  // Zones 0 to 3 are drawn from the fine level, whose first voxels show; zones 4 to 7 from the coarse one, whose last voxels do.
  constexpr std::int32_t kZone = 64, kFineEnd = 32, kCoarseBegin = 240;
  const LevelMap map = {.levels = {0, 1}, .side = Uniform(kZone), .counts = {8, 1, 1}, .of_zone = {0, 0, 0, 0, 1, 1, 1, 1}};
  const auto layout_of = [&](const VolumeSummary& finer, const VolumeSummary& coarser) {
    FrameRequest request = SomeRequest();
    request.renderer = "raycast";
    const ResolvedRequest resolved = Resolved(request, finer);
    const std::vector<CoarserVolume> levels = {{2, std::make_shared<const VolumeSummary>(coarser)}};
    return MakeLayout({.summary = &finer,
                       .volume = &resolved.volume,
                       .policy = &resolved.policy,
                       .slots = 2,
                       .box_bytes_target = 48 << 10,
                       .map = &map,
                       .coarser = levels});
  };
  const Layout without = layout_of(fine, coarse);
  const Layout with = layout_of(Indexed(fine, [](const Index3& at) { return at.x < kFineEnd ? kBody : kAir; }),
                                Indexed(coarse, [](const Index3& at) { return at.x >= kCoarseBegin ? kBody : kAir; }));
  EXPECT_EQ(with.partition, without.partition);
  EXPECT_TRUE(with.filled.empty());
  const std::int32_t reach = FindRenderer("raycast")->reach();
  std::array<int, 2> shown{}, left_out{};
  for (BoxId id = 0; id < with.owners.size(); ++id) {
    ASSERT_NE(without.owners[id], kNoSlot);
    const Box& box = with.partition.boxes()[id];
    const std::size_t level = without.levels[id];
    const bool shows = level == 0 ? box.begin.x - reach < kFineEnd : (box.end.x + 1) / 2 + reach > kCoarseBegin;
    EXPECT_EQ(with.owners[id] != kNoSlot, shows) << "box " << id << " of level " << level;
    ++(shows ? shown : left_out).at(level);
  }
  for (const std::size_t level : {0, 1}) {
    EXPECT_GT(shown.at(level), 0);
    EXPECT_GT(left_out.at(level), 0);
  }
}

// A shape gives boxes to workers whatever the picture shows of the volume there, so each of them has a level: one of the setup.
TEST(StoredLayout, ABoxOutsideThePictureThatAShapeReachesHasALevel) {
  const VolumeSummary fine = StoredSummary({512, 64, 64}, Uniform(16));
  VolumeSummary coarse = StoredSummary({256, 32, 32}, Uniform(16));
  coarse.description.geometry.spacing = {2, 2, 2};
  coarse.description.geometry.orientation.origin = {0.5, 0.5, 0.5};
  constexpr std::uint8_t kNone = LevelMap::kOutside;
  const LevelMap nothing = {.side = Uniform(64), .counts = {8, 1, 1}, .of_zone = std::vector<std::uint8_t>(8, kNone)};
  const LevelMap some = {.side = Uniform(64), .counts = {8, 1, 1}, .of_zone = {kNone, kNone, 0, 0, 0, kNone, kNone, kNone}};
  const LevelMap mixed = {.levels = {0, 1}, .side = Uniform(64), .counts = {8, 1, 1}, .of_zone = {kNone, 0, 1, 1, kNone, kNone, 1, kNone}};
  for (const char* const renderer : {"raycast", "mip", "xray", "splat", "shear"}) {
    for (const LevelMap* const map : {&nothing, &some, &mixed}) {
      if (map->levels.size() > 1 && !FindRenderer(renderer)->Can(Ability::kLevels)) continue;
      for (const int workers : {1, 3, 64}) {
        FrameRequest request = SomeRequest();
        request.renderer = renderer;
        ResolvedRequest resolved = Resolved(request, fine);
        if (map->levels.size() > 1) resolved.coarser = {{2, std::make_shared<const VolumeSummary>(coarse)}};
        FrameSetup setup = MakeFrameSetup(resolved).value();
        setup.shapes.resize(1);
        setup.shapes.front().high = {511, 63, 63};
        const auto layout = std::make_shared<const Layout>(MakeLayout({.summary = &fine,
                                                                       .volume = &resolved.volume,
                                                                       .policy = &resolved.policy,
                                                                       .slots = std::uint32_t(workers),
                                                                       .box_bytes_target = 256 << 10,
                                                                       .map = map,
                                                                       .coarser = resolved.coarser}));
        const Roster roster = FullRoster(workers);
        const FramePlan plan = PlanFrame(setup, resolved.policy, roster, layout).value();
        ExpectSound(plan, roster);
        const std::vector<Placement> placements = PlacementsOf(plan);
        if (setup.format == PixelFormat::kRgba) {
          EXPECT_EQ(placements.size(), plan.layout->owners.size()) << renderer << ": the shape reaches all boxes";
        }
        for (const Placement& placement : placements) ASSERT_LE(placement.level, setup.coarser.size()) << renderer;
        std::vector<WorkerLimit> limits;
        for (const WorkerId worker : roster.slots) limits.push_back({worker, std::uint64_t{1} << 30});
        EXPECT_TRUE(FramesThatFit(plan, fine, limits).ok()) << renderer;
      }
    }
  }
}

TEST(IndexedLayout, FramingDoesNotDependOnIt) {
  const VolumeSummary unknown = StoredSummary({512, 256, 256}, Uniform(64));
  const VolumeSummary known = Indexed(unknown, [](const Index3& at) { return at.x < 100 ? kBody : kAir; });
  FrameRequest request = SomeRequest();
  request.view.fit = true;
  EXPECT_EQ(SetupOf(request, known), SetupOf(request, unknown));
}

}  // namespace
}  // namespace slabstream
