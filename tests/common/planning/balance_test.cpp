#include "common/planning/balance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numeric>

#include "common/base/find_named.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/frame_noise.h"
#include "common/planning/measured_cost.h"
#include "common/renderers/registry.h"
#include "common/volume/missing.h"
#include "tests/common/planning/support.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

constexpr std::uint32_t kSlots = 8;

double MaxOverMean(const std::vector<double>& seconds) {
  return *std::max_element(seconds.begin(), seconds.end()) * double(seconds.size()) / std::accumulate(seconds.begin(), seconds.end(), 0.0);
}

TEST(Assignments, GiveEveryBoxASlotAndNoSlotMuchMoreThanOthers) {
  Random random(61);
  SCOPED_TRACE(random.trace());
  for (const AssignmentEntry& entry : Assignments()) {
    for (const std::uint32_t slots : {1U, 2U, 3U, 5U, 8U, 13U}) {
      for (const std::size_t boxes : {0U, 1U, 5U, 13U, 40U}) {
        std::vector<double> costs(boxes, 1.0);
        std::vector<std::uint32_t> holders(boxes);  // each holds a box
        std::iota(holders.begin(), holders.end(), 0U);
        const std::vector<std::uint32_t> owners =
            entry.assign({.costs = costs, .slots = slots, .holders = holders, .holder_count = std::uint32_t(boxes)});
        ASSERT_EQ(owners.size(), boxes);
        std::vector<std::size_t> counts(slots);
        for (const std::uint32_t owner : owners) {
          ASSERT_LT(owner, slots);
          ++counts[owner];
        }
        const auto [least, most] = std::minmax_element(counts.begin(), counts.end());
        EXPECT_LE(*most - *least, 1U) << entry.name << " " << boxes << " boxes, " << slots << " slots";
      }
    }
  }
}

TEST(Assignments, OwnersGoToSlotsOfTheirHost) {
  Random random(64);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 200; ++i) {
    std::vector<std::uint64_t> holder_hosts(random.Integer<std::size_t>(1, 20)), slot_hosts(random.Integer<std::size_t>(1, 12));
    for (auto* hosts : {&holder_hosts, &slot_hosts}) {
      for (std::uint64_t& host : *hosts) host = random.Integer<std::uint64_t>(0, 3);
    }
    std::vector<std::uint32_t> holders(holder_hosts.size());
    std::iota(holders.begin(), holders.end(), 0U);
    const std::vector<double> costs(holders.size(), 1.0);
    const std::vector<std::uint32_t> slots = FindNamed(Assignments(), "owner")
                                                 ->assign({.costs = costs,
                                                           .slots = std::uint32_t(slot_hosts.size()),
                                                           .holders = holders,
                                                           .holder_count = std::uint32_t(holders.size()),
                                                           .holder_hosts = holder_hosts,
                                                           .slot_hosts = slot_hosts});
    std::map<std::uint64_t, std::map<std::uint32_t, std::size_t>> taken;  // by host and slot
    for (std::size_t holder = 0; holder < slots.size(); ++holder) {
      const std::uint64_t host = holder_hosts[holder];
      const bool has_slot = host != 0 && std::ranges::count(slot_hosts, host) > 0;
      if (has_slot) {
        EXPECT_EQ(slot_hosts[slots[holder]], host);
      }
      ++taken[has_slot ? host : 0][slots[holder]];
    }
    for (const auto& [host, counts] : taken) {
      const std::size_t there = host == 0 ? slot_hosts.size() : std::size_t(std::ranges::count(slot_hosts, host));
      std::size_t all = 0, most = 0;
      for (const auto& [slot, count] : counts) {
        all += count;
        most = std::max(most, count);
      }
      EXPECT_LE(most, (all + there - 1) / there);
    }
  }
}

TEST(Assignments, NobodyGetsBoxesOfOwnersThatAreGone) {
  VolumeSummary summary = FullSummary({64, 64, 64});
  OwnedBoxes owned;
  for (const std::uint32_t owner : {0U, 1U, kNoOwner, 3U}) {
    const auto z = std::int32_t(16 * owned.size());
    owned.push_back({{{0, 0, z}, {64, 64, z + 16}}, owner});
  }
  summary.owned = std::make_shared<const OwnedBoxes>(owned);
  summary.owner_hosts = {7, 8, 0, 8};
  const ClassifiedVolume volume{1, std::get<TransferFunction>(SomeRequest().transfer.choice), &DefaultRenderer()};
  const ResolvedPolicy policy = ResolvePolicy({.assignment = "owner"}, summary.description.geometry);
  const std::vector<std::uint64_t> hosts = {8, 7};
  const Layout layout = MakeLayout({.summary = &summary, .volume = &volume, .policy = &policy, .slots = 2, .hosts = hosts});
  ASSERT_GE(layout.owners.size(), 4U);
  for (std::size_t box = 0; box < layout.owners.size(); ++box) {
    const std::uint32_t slots[] = {1, 0, kNoSlot, 0};
    EXPECT_EQ(layout.owners[box], slots[layout.partition.boxes()[box].begin.z / 16]);
  }
}

TEST(Assignments, GreedyKeepsWithinGrahamsBound) {
  Random random(62);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    std::vector<double> costs(std::size_t(random.Integer(1, 60)));
    for (double& cost : costs) cost = std::exp(random.Real(-2, 2));
    const auto slots = random.Integer<std::uint32_t>(1, 13);
    std::vector<double> loads(slots);
    const std::vector<std::uint32_t> owners = FindNamed(Assignments(), "greedy")->assign({costs, slots});
    for (std::size_t box = 0; box < costs.size(); ++box) loads[owners[box]] += costs[box];
    // Of any assignment: not below the mean, nor below the costliest box, nor below two of the slots + 1 costliest.
    double least = std::max(std::accumulate(costs.begin(), costs.end(), 0.0) / slots, *std::max_element(costs.begin(), costs.end()));
    std::sort(costs.rbegin(), costs.rend());
    if (costs.size() > slots) least = std::max(least, costs[slots - 1] + costs[slots]);
    EXPECT_LE(*std::max_element(loads.begin(), loads.end()), least * (4.0 / 3 + 1e-9));
  }
}

// A volume where every cell is occupied, with true costs that the occupancy does not tell.
struct DividedWorld {
  Index3 size{128, 128, 256};
  VolumeSummary summary = FullSummary(size);
  ClassifiedVolume volume{1, std::get<TransferFunction>(SomeRequest().transfer.choice), &DefaultRenderer()};
  OccupancyGrid grid{size, std::vector<CellOccupancy>(16 * 16 * 32, FullCell({{0, 0, 0}, {8, 8, 8}}))};
  Policy policy{.decomposition = "kd-tree", .groups = 1, .balance = "dynamic"};
  mutable ResolvedPolicy resolved;  // of the last Request
  double seconds_a_cell = 1e-4;
  bool even = false;  // all cells cost the same
  Random random{63};

  // Hotter towards the top of z, and a hot corner.
  WorkField Truth() const {
    std::vector<double> work;
    for (std::int32_t z = 0; z < 32; ++z) {
      for (std::int32_t y = 0; y < 16; ++y) {
        for (std::int32_t x = 0; x < 16; ++x) work.push_back(seconds_a_cell * (even ? 1 : 1 + 0.1 * z + (x < 5 && y < 5 && z < 9 ? 8 : 0)));
      }
    }
    return {size, work};
  }
  LayoutRequest Request(const WorkField* cost) const {
    resolved = ResolvePolicy(policy, summary.description.geometry);
    return {.summary = &summary, .volume = &volume, .policy = &resolved, .slots = kSlots, .known = {.occupied = &grid, .cost = cost}};
  }
  std::vector<BoxSeconds> Render(const Layout& layout, double noise) {
    const WorkField truth = Truth();
    std::vector<BoxSeconds> seconds;
    for (std::size_t box = 0; box < layout.owners.size(); ++box) {
      if (layout.owners[box] == kNoSlot) continue;
      const Box& voxels = layout.partition.boxes()[box];
      seconds.push_back({voxels, (truth.Sum(voxels) + 1e-3 * seconds_a_cell) * (1 + random.Real(-noise, noise))});
    }
    return seconds;
  }

  struct Outcome {
    double imbalance = 0;  // of the last layout, as the truth is
    int changes = 0;
    int last_change = -1;
  };
  Outcome Play(int frames, double noise) {
    Outcome outcome;
    MeasuredCost learnt(grid);
    Layout layout = MakeLayout(Request(nullptr));
    FrameNoise scatter;
    int seen = 0;
    std::vector<double> average;  // by box
    for (int frame = 0; frame < frames; ++frame) {
      const double weight = std::max(0.2, 1.0 / ++seen);
      if (seen == 1) average.assign(layout.owners.size(), 0);
      const std::vector<BoxSeconds> rendered = Render(layout, noise);
      learnt.Learn(rendered, weight);
      std::vector<double> deviations;
      for (std::size_t box = 0, i = 0; box < average.size(); ++box) {
        if (layout.owners[box] == kNoSlot) continue;
        const double time = rendered[i++].seconds;
        if (average[box] > 0) deviations.push_back(time / average[box] - 1);
        average[box] += weight * (time - average[box]);
      }
      if (!deviations.empty()) scatter.Learn(deviations, std::clamp(seen - 1, 1, kMostFramesAveraged));
      const WorkField cost = learnt.Field();
      const LayoutRequest make = Request(&cost);
      if (std::optional<Layout> better = resolved.balance->change({&layout, average, &make, seen, scatter.deviation()})) {
        layout = *std::move(better);
        seen = 0;
        ++outcome.changes;
        outcome.last_change = frame;
      }
    }
    std::vector<double> slots(kSlots);
    const WorkField truth = Truth();
    for (std::size_t box = 0; box < layout.owners.size(); ++box) {
      if (layout.owners[box] != kNoSlot) slots[layout.owners[box]] += truth.Sum(layout.partition.boxes()[box]);
    }
    outcome.imbalance = MaxOverMean(slots);
    return outcome;
  }
};

TEST(Balance, ConvergesWithinFiveFrames) {
  for (const std::string decomposition : {"slab", "beam", "subcube", "kd-tree"}) {
    DividedWorld world;
    world.policy.decomposition = decomposition;
    EXPECT_GT(world.Play(0, 0).imbalance, 1.3) << decomposition;
    EXPECT_LT(world.Play(5, 0).imbalance, 1.05) << decomposition;
  }
}

// What holds of all: boxes stay a partition with owners, and frames become quicker where all is measured exactly.
TEST(Balances, ImproveWhatIsMeasuredExactly) {
  for (const BalanceEntry& balance : Balances()) {
    if (balance.change == nullptr) continue;
    for (const std::string decomposition : {"slab", "kd-tree"}) {
      SCOPED_TRACE(testing::Message() << balance.name << ", " << decomposition);
      DividedWorld world;
      world.policy.decomposition = decomposition;
      world.policy.balance = balance.name;
      EXPECT_LT(world.Play(8, 0).imbalance, 1.1);
    }
  }
}

TEST(Balance, HandsOverBoxesWhereTheyCannotBeCutAnew) {
  DividedWorld world;
  world.policy.decomposition = "octree";
  world.policy.groups = 6;  // 64 boxes
  const double before = world.Play(0, 0).imbalance, after = world.Play(5, 0).imbalance;
  EXPECT_GT(before, 1.1);
  EXPECT_LT(after, 1.1);
}

TEST(Balance, DoesNotOscillateUnderNoise) {
  DividedWorld world;
  SCOPED_TRACE(world.random.trace());
  const DividedWorld::Outcome outcome = world.Play(200, 0.03);
  EXPECT_LE(outcome.changes, 6);
  EXPECT_LT(outcome.imbalance, 1.08);
}

// Times that scatter as on busy machines: what is even is left alone.
TEST(Balance, FollowsNoChance) {
  DividedWorld world;
  SCOPED_TRACE(world.random.trace());
  world.even = true;
  EXPECT_LE(world.Play(200, 0.6).changes, 1);
}

// Nearly normal, of deviation 1.
double Normal(Random& random) {
  double sum = 0;
  for (int i = 0; i < 12; ++i) sum += random.Real(-0.5, 0.5);
  return sum;
}

TEST(FrameNoise, IsTheDeviationOfMostBoxes) {
  Random random(65);
  SCOPED_TRACE(random.trace());
  FrameNoise noise;
  EXPECT_FALSE(noise.deviation());
  for (int frame = 0; frame < 200; ++frame) {
    std::vector<double> deviations;
    const double common = random.Real(-0.5, 0.5);  // of all boxes of the frame
    for (int box = 0; box < 64; ++box) deviations.push_back(common + 0.1 * Normal(random));
    deviations.front() = 3;  // a worker that has become slow
    noise.Learn(deviations, 9);
  }
  EXPECT_NEAR(noise.deviation().value() * std::sqrt(1 + 1.0 / 9), 0.1, 0.02);
}

TEST(Balance, MovesNothingWhereItDoesNotPay) {
  DividedWorld world;
  world.seconds_a_cell = 1e-9;  // what could be won is less than the voxels cost
  EXPECT_EQ(world.Play(20, 0).changes, 0);

  // Nor what is even already.
  Layout layout = MakeLayout(world.Request(nullptr));
  const WorkField even = WorkField(world.grid);
  const std::vector<double> seconds = PredictedSeconds(layout, even);
  const LayoutRequest make = world.Request(&even);
  EXPECT_FALSE(Rebalance({&layout, seconds, &make, 1, 0.0}).has_value());
}

TEST(Balance, ReassigningNeverMakesAFrameSlower) {
  DividedWorld world;
  world.policy.decomposition = "subcube";
  world.policy.groups = 5;
  for (const AssignmentEntry& assignment : Assignments()) {
    if (assignment.by_owner) continue;  // nobody owns these voxels
    world.policy.assignment = assignment.name;
    const WorkField truth = world.Truth();
    const Layout before = MakeLayout(world.Request(nullptr));
    const std::vector<double> seconds = PredictedSeconds(before, truth);
    const Layout after = Reassign(before, kSlots, seconds);
    EXPECT_EQ(after.partition, before.partition);
    EXPECT_LE(FrameSeconds(after, kSlots, seconds), FrameSeconds(before, kSlots, seconds));
    // No slot is further above the mean than a box weighs.
    const double largest = *std::max_element(seconds.begin(), seconds.end());
    EXPECT_LE(FrameSeconds(after, kSlots, seconds), truth.total() / kSlots + largest) << assignment.name;
  }
}

TEST(MovedVoxels, AreThoseThatASlotDidNotHoldWithTheirHalo) {
  const WorkField voxels = WorkField::Uniform({10, 10, 60});
  const Layout from = {MakeSlabs({.work = &voxels, .boxes = 3}), {0, 1, kNoSlot}};
  Layout to = from;
  EXPECT_EQ(MovedVoxels(from, to), 0);
  to.owners = {0, kNoSlot, kNoSlot};
  EXPECT_EQ(MovedVoxels(from, to), 0);
  to.owners = {1, 1, 2};
  EXPECT_EQ(MovedVoxels(from, to), 10 * 10 * ((28 - 16) + 28)) << "slot 1 held the halo of its box, twice 8 slices";
}

TEST(MeasuredCost, AddsUpToWhatFramesTook) {
  DividedWorld world;
  MeasuredCost learnt(world.grid);
  EXPECT_FALSE(learnt.any());
  const Layout layout = MakeLayout(world.Request(nullptr));
  const std::vector<BoxSeconds> frame = world.Render(layout, 0);
  learnt.Learn(frame, 1);
  EXPECT_TRUE(learnt.any());
  const WorkField field = learnt.Field();
  // Cells that a plane cuts in two belong to both.
  for (const BoxSeconds& box : frame) EXPECT_NEAR(field.Sum(box.box), box.seconds, 0.1 * box.seconds);

  // What takes no time is not learnt to be nothing.
  std::vector<BoxSeconds> hidden = frame;
  hidden[0].seconds = 0;
  learnt.Learn(hidden, 1);
  EXPECT_GT(learnt.Field().Sum(frame[0].box), 0);
}

}  // namespace
}  // namespace slabstream
