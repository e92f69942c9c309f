#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "common/combining/schemes.h"
#include "common/combining/travel.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/classified_volume.h"
#include "common/planning/frame_plan.h"
#include "common/planning/policy_names.h"
#include "common/planning/validate_request.h"
#include "tests/planning/support.h"
#include "tests/support/check_schedule.h"
#include "tests/support/random.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

FramePlan Plan(const FrameRequest& request, const VolumeSummary& summary, const Roster& roster) {
  Result<FramePlan> plan = PlanFrame(request, 7, summary, roster, {});
  EXPECT_TRUE(plan.ok()) << plan.status().message();
  return *plan;
}

// What every plan must be, whatever it was made for.
void ExpectSound(const FramePlan& plan, const Roster& roster) {
  std::vector<BoxId> order = VisibilityOrder(plan.layout->partition, plan.setup.camera);
  ASSERT_EQ(plan.layout->owners.size(), order.size());
  std::erase_if(order, [&](BoxId box) { return plan.layout->owners[box] == kNoSlot; });
  EXPECT_EQ(plan.groups.size(), std::max<std::size_t>(1, (order.size() + plan.slots - 1) / plan.slots));
  const std::vector<WorkerId> owners = OwnersOf(*plan.layout, roster);

  // The placements of all groups are the boxes that show something, in visibility order, each in the group where it belongs.
  std::map<BoxId, std::size_t> position;
  for (std::size_t i = 0; i < order.size(); ++i) position[order[i]] = i;
  const PixelRange frame = WholeFrame(plan.setup);
  for (std::size_t g = 0; g < plan.groups.size(); ++g) {
    const GroupPlan& group = plan.groups[g];
    for (std::size_t rank = 0; rank < group.placements.size(); ++rank) {
      const Placement& placement = group.placements[rank];
      EXPECT_EQ(placement.box, plan.layout->partition.boxes()[placement.id]);
      EXPECT_EQ(position[placement.id] / plan.slots, g);
      if (rank > 0) {
        EXPECT_LT(position[group.placements[rank - 1].id], position[placement.id]);
      }
      EXPECT_EQ(placement.worker, owners[placement.id]);
      EXPECT_NE(placement.worker, 0U);
    }
    EXPECT_EQ(group.schedule.ranks, group.placements.size());
    EXPECT_EQ(CheckSchedule(DeriveSchedule(group.schedule, frame).value()->schedule(), frame), Status::Ok());
    // The display worker gets the group's image without another message if it has a rank.
    const bool has_rank = std::any_of(group.placements.begin(), group.placements.end(), [&](auto& p) { return p.worker == plan.display; });
    if (has_rank) {
      EXPECT_EQ(group.placements[group.schedule.root].worker, plan.display);
    }
  }
  EXPECT_NE(plan.display, 0U);
  EXPECT_NE(std::find(roster.slots.begin(), roster.slots.end(), plan.display), roster.slots.end());
}

std::vector<BoxId> PlacedBoxes(const FramePlan& plan) {
  std::vector<BoxId> boxes;
  for (const GroupPlan& group : plan.groups) {
    for (const Placement& placement : group.placements) boxes.push_back(placement.id);
  }
  return boxes;
}

TEST(PlanFrame, IsSoundForAnyWorkersGroupsAndSizes) {
  for (const Index3& size : {Index3{1, 1, 1}, Index3{40, 40, 1}, Index3{33, 70, 20}, Index3{128, 64, 100}}) {
    const VolumeSummary summary = FullSummary(size);
    for (int workers : {1, 2, 3, 5, 8, 13, 64}) {
      for (int groups : {0, 1, 2, 7, 40}) {
        for (AxisChoice axis : {AxisChoice::kX, AxisChoice::kY, AxisChoice::kZ, AxisChoice::kAuto, AxisChoice::kView}) {
          SCOPED_TRACE(testing::Message() << size.x << "x" << size.y << "x" << size.z << ", " << workers << " workers, " << groups
                                          << " groups, axis " << int(axis));
          FrameRequest request = SomeRequest();
          request.policy.groups = groups;
          request.policy.axis = axis;
          request.view.azimuth_degrees = 200;
          const Roster roster = FullRoster(workers);
          const FramePlan plan = Plan(request, summary, roster);
          ExpectSound(plan, roster);
          EXPECT_EQ(PlacedBoxes(plan).size(), plan.layout->partition.boxes().size());  // everything is visible
          if (groups > 0 && groups * workers <= size[plan.slab_axis]) {
            EXPECT_EQ(plan.groups.size(), std::size_t(groups));
          }
        }
      }
    }
  }
}

TEST(PlanFrame, UsesEveryNameOfAPolicy) {
  const VolumeSummary summary = FullSummary({40, 40, 40});
  for (const CombiningEntry& scheme : CombiningSchemes()) {
    for (const DecompositionEntry& decomposition : Decompositions()) {
      FrameRequest request = SomeRequest();
      request.policy.combine = scheme.name;
      request.policy.decomposition = decomposition.name;
      for (const AssignmentEntry& assignment : Assignments()) {
        for (const NamedChoice& split : LoadMetrics()) {
          request.policy.assignment = assignment.name;
          request.policy.load_metric = split.name;
          request.policy.groups = 2;
          const Roster roster = FullRoster(5);
          ExpectSound(Plan(request, summary, roster), roster);
        }
      }
    }
  }
}

TEST(PlanFrame, SlabsAlongTheViewDivideNoSlice) {
  Random random(92);
  SCOPED_TRACE(random.trace());
  const VolumeSummary summary = FullSummary({40, 90, 50});
  const Roster roster = FullRoster(4);
  FrameRequest request = SomeRequest();
  request.policy.axis = AxisChoice::kView;
  for (int i = 0; i < 50; ++i) {
    request.view = RandomView(random);
    const FramePlan plan = Plan(request, summary, roster);
    EXPECT_EQ(plan.slab_axis, plan.setup.camera.traversal_axis);
    // As if the axis had been asked for: other views along it share the layout.
    FrameRequest same = request;
    same.policy.axis = AxisChoice(plan.slab_axis);
    FramePlan other = Plan(same, summary, roster);
    EXPECT_EQ(*other.layout, *plan.layout);
    other.layout = plan.layout;  // plans are equal if they share it
    EXPECT_EQ(other, plan);
  }
}

TEST(PlanFrame, TurningTheViewReversesRanksButNeverOwnership) {
  Random random(91);
  SCOPED_TRACE(random.trace());
  const VolumeSummary summary = FullSummary({40, 90, 50});
  const Roster roster = FullRoster(4);
  FrameRequest request = SomeRequest();
  request.policy.groups = 3;
  request.policy.axis = AxisChoice::kY;
  const FramePlan first = Plan(request, summary, roster);
  for (int i = 0; i < 50; ++i) {
    request.view = RandomView(random);
    const FramePlan plan = Plan(request, summary, roster);
    EXPECT_EQ(plan.layout->partition, first.layout->partition);
    std::vector<BoxId> forward = PlacedBoxes(first), boxes = PlacedBoxes(plan);
    if (plan.setup.camera.view_direction.y < 0 && request.view.projection == Projection::kOrthographic) {
      std::reverse(forward.begin(), forward.end());
      EXPECT_EQ(boxes, forward);
    }
    for (const GroupPlan& group : plan.groups) {
      std::set<WorkerId> workers;
      for (const Placement& placement : group.placements) {
        EXPECT_EQ(placement.worker, roster.slots[placement.id % 4]);
        workers.insert(placement.worker);
      }
      EXPECT_EQ(workers.size(), group.placements.size());  // nobody renders two slabs of a group
    }
  }
}

TEST(PlanFrame, AutomaticChoicesDoNotDependOnTheView) {
  Random random(92);
  SCOPED_TRACE(random.trace());
  const VolumeSummary summary = FullSummary({100, 300, 300});
  constexpr std::int64_t kTarget = 1 << 20;
  FrameRequest request = SomeRequest();
  const Result<FramePlan> first = PlanFrame(request, 7, summary, FullRoster(2), nullptr, {}, kTarget);
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(first->slab_axis, Axis::kZ);  // about which views turn
  EXPECT_GT(first->groups.size(), 1U);
  for (int i = 0; i < 50; ++i) {
    request.view = RandomView(random);
    const Result<FramePlan> plan = PlanFrame(request, 7, summary, FullRoster(2), nullptr, {}, kTarget);
    ASSERT_TRUE(plan.ok());
    EXPECT_EQ(plan->layout->partition, first->layout->partition);
  }
}

TEST(PlanFrame, ChoosesTheFewestGroupsWhoseSlabsStayUnderTheTarget) {
  const VolumeSummary summary = FullSummary({64, 64, 1000});
  const std::int64_t slice_bytes = 64 * 64;
  const auto groups = [&](std::int64_t target_slices, int workers) {
    return PlanFrame(SomeRequest(), 7, summary, FullRoster(workers), nullptr, {}, target_slices * slice_bytes)->groups.size();
  };
  EXPECT_EQ(groups(1000, 1), 1U);         // all of it fits
  EXPECT_EQ(groups(999, 1), 2U);          // halves and their halos
  EXPECT_EQ(groups(500 + kHalo, 1), 2U);  // which each have one neighbour
  EXPECT_EQ(groups(500 + kHalo - 1, 1), 3U);
  EXPECT_EQ(groups(250 + 2 * kHalo, 2), 2U);
  EXPECT_EQ(groups(1, 1), 1000U / kHalo);  // not thinner than a halo
  EXPECT_EQ(groups(1, 1000), 1U);
}

TEST(PlanFrame, ChoosesGroupsByTheLargestBoxThatShowsSomething) {
  // Visible are the bricks of one corner, 48 voxels a side.
  VolumeSummary summary = FullSummary({192, 192, 192});
  std::size_t brick = 0;
  for (Index3 b; b.z < 12; ++b.z) {
    for (b.y = 0; b.y < 12; ++b.y) {
      for (b.x = 0; b.x < 12; ++b.x, ++brick) {
        if (std::max({b.x, b.y, b.z}) > 2) summary.bricks[brick] = {0, 0};
      }
    }
  }
  for (const DecompositionEntry& entry : Decompositions()) {
    FrameRequest request = SomeRequest();
    request.policy.decomposition = entry.name;
    constexpr std::int64_t kTarget = 64 * 64 * 64;
    const FramePlan plan = *PlanFrame(request, 7, summary, FullRoster(2), nullptr, {}, kTarget);
    const std::vector<Placement> placements = PlacementsOf(plan);
    ASSERT_FALSE(placements.empty());
    // Slabs across the whole volume become as thin as their halo allows, and stay too large.
    if (entry.one_axis) continue;
    for (const Placement& placement : placements) {
      EXPECT_LE(SlabBox(placement.box, plan.setup).voxel_count(), kTarget) << entry.name;
    }
  }
}

TEST(PlanFrame, LeavesOutBoxesThatShowNothing) {
  // Visible are the bricks at z in [64, 80) only.
  VolumeSummary summary = FullSummary({32, 32, 160});
  for (std::size_t brick = 0; brick < summary.bricks.size(); ++brick) {
    if (brick / 4 != 4) summary.bricks[brick] = {0, 0};
  }
  FrameRequest request = SomeRequest();  // opacity from 100 on
  request.policy.groups = 5;
  request.view.elevation_degrees = -90;  // along +z
  const Roster roster = FullRoster(2);
  const FramePlan plan = Plan(request, summary, roster);
  ExpectSound(plan, roster);
  ASSERT_EQ(plan.setup.halo, 8);
  // Slabs are 16 slices thick; the neighbours of [64, 80) see it through their halo.
  EXPECT_EQ(PlacedBoxes(plan), (std::vector<BoxId>{3, 4, 5}));
  EXPECT_EQ(plan.groups.size(), 2U);
  // Only boxes that show anything are dealt out, and the nearest one is the display worker's.
  EXPECT_EQ(plan.layout->owners, (std::vector<std::uint32_t>{kNoSlot, kNoSlot, kNoSlot, 0, 1, 0, kNoSlot, kNoSlot, kNoSlot, kNoSlot}));
  EXPECT_EQ(plan.display, roster.slots[0]);
}

TEST(PlanFrame, DisplayWorkersTakeTurns) {
  for (int workers = 1; workers <= 7; ++workers) {
    FrameRequest request = SomeRequest();
    request.policy.groups = 3;
    const Roster roster = FullRoster(workers);
    const FramePlan first = Plan(request, FullSummary({96, 96, 96}), roster);
    std::set<WorkerId> displays;
    for (std::uint64_t turn = 0; turn < 2 * std::uint64_t(workers); ++turn) {
      const FramePlan plan = TakeTurn(first, roster, {turn, 1});
      ExpectSound(plan, roster);
      EXPECT_EQ(PlacedBoxes(plan), PlacedBoxes(first));
      EXPECT_EQ(plan.display, TakeTurn(first, roster, {turn + std::uint64_t(workers), 1}).display);
      displays.insert(plan.display);
    }
    EXPECT_EQ(displays.size(), std::size_t(workers));
  }
}

TEST(PlanFrame, AnEmptyVolumeHasAPlanOfEmptyGroups) {
  VolumeSummary summary = FullSummary({32, 32, 32});
  for (ValueRange& brick : summary.bricks) brick = {0, 0};
  summary.bricks.front() = kNoFiniteValue;
  const Roster roster = FullRoster(3);
  const FramePlan plan = Plan(SomeRequest(), summary, roster);
  ExpectSound(plan, roster);
  EXPECT_TRUE(PlacedBoxes(plan).empty());
  EXPECT_EQ(plan.groups.size(), 1U);
  EXPECT_EQ(plan.groups[0].schedule, (ScheduleName{plan.combine, 0, 0}));
  EXPECT_EQ(plan.display, roster.slots[0]);
}

TEST(PlanFrame, SetupHoldsWhatTheRequestAsksFor) {
  FrameRequest request = SomeRequest();
  request.renderer = ZBuffer()->name();
  request.termination = 0.25;
  request.transfer.opacity_distance = 3;
  request.shading.phong = false;
  request.size = {100, 50};
  const VolumeSummary summary = FullSummary({40, 41, 42});
  const FrameSetup setup = Plan(request, summary, FullRoster(2)).setup;
  EXPECT_EQ(setup.dataset, 7U);
  EXPECT_EQ(setup.description, summary.description);
  EXPECT_EQ(setup.range, summary.range);
  EXPECT_EQ(setup.renderer, ZBuffer());
  EXPECT_EQ(setup.camera, MakeSupersampledCamera(request.view, request.size, summary.description.geometry));
  EXPECT_EQ(setup.transfer.opacity_distance, 3);
  EXPECT_EQ(setup.shading, request.shading);
  EXPECT_EQ(setup.termination, 0.25);
  EXPECT_EQ(setup.halo, kHalo);
}

// Splatting renders a grid along the slices and the display worker makes the picture of it; the Z-buffer renders the supersampled picture.
TEST(PlanFrame, TheFrameIsWhatThePipelineRenders) {
  FrameRequest request = SomeRequest();
  request.view = {.azimuth_degrees = 30, .elevation_degrees = 20, .zoom = 0.2};
  const VolumeSummary summary = FullSummary({40, 41, 42});
  const VolumeGeometry& geometry = summary.description.geometry;
  const FrameSetup splat = Plan(request, summary, FullRoster(2)).setup;
  EXPECT_EQ(splat.camera, MakeCamera(request.view, request.size, geometry));
  EXPECT_EQ(splat.sheets, MakeSheetGrid(splat.camera, geometry));
  EXPECT_EQ(FrameBounds(splat), (PixelBounds{0, 0, splat.sheets.width, splat.sheets.height}));

  request.renderer = ZBuffer()->name();
  const FrameSetup zbuffer = Plan(request, summary, FullRoster(2)).setup;
  EXPECT_GT(zbuffer.camera.supersample, 1);
  EXPECT_EQ(FrameBounds(zbuffer), (PixelBounds{0, 0, zbuffer.camera.width, zbuffer.camera.height}));
  EXPECT_EQ(WholeFrame(zbuffer).end, std::uint64_t(zbuffer.camera.width) * std::uint64_t(zbuffer.camera.height));
}

// Seen obliquely, slices that lie far apart for the width of their voxels need absurdly wide images.
TEST(PlanFrame, RefusesViewsThatCannotBeRendered) {
  FrameRequest request = SomeRequest();
  request.view.elevation_degrees = -50;
  VolumeSummary summary = FullSummary({64, 64, 600});
  EXPECT_TRUE(PlanFrame(request, 7, summary, FullRoster(1), {}).ok());
  summary.description.geometry.spacing = {1, 1, 3000};
  const Status status = PlanFrame(request, 7, summary, FullRoster(1), {}).status();
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  EXPECT_NE(status.message().find("at most 131072 a side"), std::string::npos) << status.message();
}

TEST(PlanFrame, ResolvesPresets) {
  FrameRequest request = SomeRequest();
  request.transfer = {"auto", 2.5};
  const VolumeSummary summary = FullSummary({40, 41, 42});
  TransferFunction expected = *MakePreset("auto", summary);
  expected.opacity_distance = 2.5;
  EXPECT_EQ(Plan(request, summary, FullRoster(1)).setup.transfer, expected);
}

TEST(ResolvePolicy, OfWhatItAskedForIsTheSame) {
  const VolumeGeometry geometry = FullSummary({40, 200, 42}).description.geometry;
  FrameRequest request = SomeRequest();
  for (const DecompositionEntry& decomposition : Decompositions()) {
    for (const AssignmentEntry& assignment : Assignments()) {
      for (const NamedChoice& split : LoadMetrics()) {
        for (const AxisChoice axis : {AxisChoice::kX, AxisChoice::kAuto, AxisChoice::kView}) {
          request.policy = {.decomposition = std::string(decomposition.name),
                            .load_metric = std::string(split.name),
                            .axis = axis,
                            .assignment = std::string(assignment.name),
                            .balance = std::string(kDynamicBalance)};
          const Result<ResolvedPolicy> resolved = ResolvePolicy(request, geometry);
          ASSERT_TRUE(resolved.ok()) << resolved.status().message();
          EXPECT_EQ(resolved->decomposition, &decomposition);
          EXPECT_EQ(resolved->assignment, &assignment);
          EXPECT_EQ(NeedsOccupancy(*resolved), NeedsOccupancy(request.policy));
          request.policy = AskFor(*resolved);
          EXPECT_EQ(*ResolvePolicy(request, geometry), *resolved);
        }
      }
    }
  }
}

TEST(ClassifiedVolume, IsAKeyByWhatItIs) {
  const TransferFunction transfer = std::get<TransferFunction>(SomeRequest().transfer.choice);
  const ClassifiedVolume volume(3, transfer, Splatting()), same(3, transfer, Splatting());
  EXPECT_EQ(volume, same);
  EXPECT_EQ(volume.hash(), same.hash());
  TransferFunction other = transfer;
  other.opacities.back().opacity /= 2;
  EXPECT_NE(volume, ClassifiedVolume(4, transfer, Splatting()));
  EXPECT_NE(volume, ClassifiedVolume(3, transfer, ZBuffer()));
  EXPECT_NE(volume, ClassifiedVolume(3, other, Splatting()));
}

TEST(PlanFrame, NamesWhatItDoesNotKnow) {
  const VolumeSummary summary = FullSummary({8, 8, 8});
  const auto status = [&](auto change, const Roster& roster) {
    FrameRequest request = SomeRequest();
    change(request);
    return PlanFrame(request, 7, summary, roster, {}).status();
  };
  EXPECT_EQ(status([](auto& r) { r.policy.decomposition = "cake"; }, FullRoster(1)),
            Status::InvalidArgument("policy.decomposition is 'cake', but must be one of: auto, slab, beam, subcube, octree, kd-tree"));
  EXPECT_EQ(status([](auto& r) { r.policy.load_metric = "hairs"; }, FullRoster(1)),
            Status::InvalidArgument("policy.load_metric is 'hairs', but must be one of: auto, voxels, occupied, cost"));
  EXPECT_EQ(status([](auto& r) { r.policy.assignment = "lots"; }, FullRoster(1)),
            Status::InvalidArgument("policy.assignment is 'lots', but must be one of: auto, cyclic, contiguous, greedy"));
  EXPECT_EQ(status([](auto& r) { r.policy.balance = "act"; }, FullRoster(1)),
            Status::InvalidArgument("policy.balance is 'act', but must be one of: static, dynamic"));
  EXPECT_EQ(
      status([](auto& r) { r.policy.combine = "mix"; }, FullRoster(1)),
      Status::InvalidArgument("policy.combine 'mix' is not one of fan-in, centralized, chain, tree, radix-k, binary-swap, direct-send"));
  const Status open = Status::InvalidArgument("policy: 'auto' leaves a choice, which must be made before a frame is planned");
  EXPECT_EQ(status([](auto& r) { r.policy.decomposition = kAutomatic; }, FullRoster(1)), open);
  EXPECT_EQ(status([](auto& r) { r.policy.assignment = kAutomatic; }, FullRoster(1)), open);
  EXPECT_EQ(status([](auto& r) { r.policy.combine = kAutomatic; }, FullRoster(1)), open);
  EXPECT_EQ(status([](auto& r) { r.transfer.choice = "no-such-preset"; }, FullRoster(1)).code(), StatusCode::kNotFound);
  for (const Roster& nobody : {Roster{}, Roster{{0}}, Roster{{0, 0, 0}}}) {
    EXPECT_EQ(status([](auto&) {}, nobody).code(), StatusCode::kUnavailable);
  }
}

TEST(PlanFrame, ColoursTravelInAsManyBitsAsTheirErrorAllows) {
  const VolumeSummary summary = FullSummary({40, 40, 40});
  FrameRequest request = SomeRequest();
  request.policy.groups = 1;
  const auto color = [&](double pixel_error, int workers) {
    request.policy.pixel_error = pixel_error;
    const FramePlan plan = Plan(request, summary, FullRoster(workers));
    for (const GroupPlan& group : plan.groups) {
      const Travel travel = TravelOf(DeriveSchedule(group.schedule, WholeFrame(plan.setup)).value(), WholeFrame(plan.setup));
      EXPECT_LE(CodingError(group.color, travel.hops, travel.transfers), pixel_error);
    }
    return plan.groups[0].color;
  };
  for (int workers : {2, 5, 8}) {
    EXPECT_EQ(color(0, workers), ColorCoding::kFloat32);
    EXPECT_EQ(color(1e-6, workers), ColorCoding::kFloat32);
    EXPECT_EQ(color(1.0 / 1024, workers), ColorCoding::kFixed16);
  }
  request.policy.combine = "centralized";
  request.policy.groups = 1;
  const VolumeSummary large = FullSummary({16, 16, 400});
  request.policy.pixel_error = 1.0 / 1024;
  const FramePlan plan = Plan(request, large, FullRoster(100));
  EXPECT_EQ(plan.groups[0].color, ColorCoding::kHalf) << "99 transfers, but one hop";
  request.renderer = ZBuffer()->name();
  EXPECT_EQ(color(kMaxPixelError, 5), ColorCoding::kFloat32);
  request.policy.pixel_error = 0.2;
  EXPECT_EQ(Validate(request).code(), StatusCode::kInvalidArgument);
}

// ---- lost workers

TEST(Replan, ReassignsLostBoxesAndChangesNothingElse) {
  const VolumeSummary summary = FullSummary({40, 40, 120});
  for (const CombiningEntry& scheme : CombiningSchemes()) {
    for (int workers : {2, 3, 5, 8}) {
      FrameRequest request = SomeRequest();
      request.policy.groups = 3;
      request.policy.combine = scheme.name;
      const FramePlan plan = Plan(request, summary, FullRoster(workers));
      for (int lost = 0; lost < workers; ++lost) {
        SCOPED_TRACE(testing::Message() << scheme.name << ", " << workers << " workers, lost " << lost);
        Roster rest = FullRoster(workers);
        rest.slots[std::size_t(lost)] = 0;
        const Result<FramePlan> again = Replan(plan, rest);
        ASSERT_TRUE(again.ok());
        ExpectSound(*again, rest);
        EXPECT_EQ(again->setup, plan.setup);
        EXPECT_EQ(again->layout->partition, plan.layout->partition);
        EXPECT_EQ(PlacedBoxes(*again), PlacedBoxes(plan));
        ASSERT_EQ(again->groups.size(), plan.groups.size());
        std::set<WorkerId> lenders;
        for (std::size_t g = 0; g < plan.groups.size(); ++g) {
          ASSERT_EQ(again->groups[g].placements.size(), plan.groups[g].placements.size());
          for (std::size_t rank = 0; rank < plan.groups[g].placements.size(); ++rank) {
            const WorkerId before = plan.groups[g].placements[rank].worker, after = again->groups[g].placements[rank].worker;
            if (before == WorkerId(lost + 1)) {
              lenders.insert(after);
            } else {
              EXPECT_EQ(after, before);
            }
          }
        }
        EXPECT_EQ(lenders.size(), std::size_t(std::min(3, workers - 1)));  // its three boxes go to different workers
        if (plan.display != WorkerId(lost + 1)) {
          EXPECT_EQ(again->display, plan.display);
        }
        // Back again, or another in its place: everything as it was.
        Roster back = FullRoster(workers);
        EXPECT_EQ(PlacedBoxes(*Replan(*again, back)), PlacedBoxes(plan));
      }
    }
  }
}

TEST(Replan, SurvivesAllButOne) {
  Random random(93);
  SCOPED_TRACE(random.trace());
  const VolumeSummary summary = FullSummary({40, 40, 120});
  FrameRequest request = SomeRequest();
  request.policy.groups = 4;
  FramePlan plan = Plan(request, summary, FullRoster(9));
  Roster roster = FullRoster(9);
  for (int left = 8; left >= 1; --left) {
    std::size_t lost = random.Integer<std::size_t>(0, 8);
    while (roster.slots[lost] == 0) lost = (lost + 1) % 9;
    roster.slots[lost] = 0;
    const Result<FramePlan> next = Replan(plan, roster);
    ASSERT_TRUE(next.ok());
    ExpectSound(*next, roster);
    plan = *next;
  }
  EXPECT_EQ(Replan(plan, Roster{std::vector<WorkerId>(9)}).status().code(), StatusCode::kUnavailable);
}

TEST(OwnersOf, LendsTheBoxesOfVacantSlotsEvenly) {
  for (const AssignmentEntry& assignment : Assignments()) {
    const Roster roster = {{11, 0, 13, 0, 15}};
    Layout layout;
    layout.owners = assignment.assign({std::vector<double>(5 * 30, 1.0), 5});
    layout.owners.insert(layout.owners.begin() + 7, kNoSlot);
    const std::vector<WorkerId> owners = OwnersOf(layout, roster);
    ASSERT_EQ(owners.size(), layout.owners.size());
    std::map<WorkerId, int> lent;
    for (std::size_t box = 0; box < owners.size(); ++box) {
      if (layout.owners[box] == kNoSlot) {
        EXPECT_EQ(owners[box], 0U);
      } else if (roster.slots[layout.owners[box]] != 0) {
        EXPECT_EQ(owners[box], roster.slots[layout.owners[box]]);
      } else {
        ++lent[owners[box]];
      }
    }
    EXPECT_EQ(lent, (std::map<WorkerId, int>{{11, 20}, {13, 20}, {15, 20}})) << assignment.name;
    EXPECT_EQ(OwnersOf(layout, Roster{{0, 0, 0, 0, 0}}), std::vector<WorkerId>(layout.owners.size()));
  }
}

}  // namespace
}  // namespace slabstream
