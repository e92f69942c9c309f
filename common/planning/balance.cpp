#include "common/planning/balance.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/calibration/calibration.h"
#include "common/view/sheet_grid.h"
#include "common/volume/box_assembly.h"

namespace slabstream {
namespace {

constexpr double kLasts = 2;                  // times as long as a layout has lasted it is taken to last
constexpr double kLeastGain = 0.02;           // share of the frame's render time that a change must save; times 1 + 1/n after n frames
constexpr double kLeastGainOfNewBoxes = 0.1;  // share of the frame's render time that new boxes must save beyond resized ones

std::vector<double> SlotSeconds(const Layout& layout, std::uint32_t slots, std::span<const double> seconds) {
  CHECK_EQ(seconds.size(), layout.owners.size());
  std::vector<double> sums(slots);
  for (std::size_t box = 0; box < seconds.size(); ++box) {
    if (layout.owners[box] != kNoSlot) sums[layout.owners[box]] += seconds[box];
  }
  return sums;
}

}  // namespace

std::vector<double> PredictedSeconds(const Layout& layout, const WorkField& cost) {
  std::vector<double> seconds(layout.owners.size());
  for (std::size_t box = 0; box < seconds.size(); ++box) {
    if (layout.owners[box] != kNoSlot) seconds[box] = cost.Sum(layout.partition.boxes()[box]);
  }
  return seconds;
}

double FrameSeconds(const Layout& layout, std::uint32_t slots, std::span<const double> seconds) {
  const std::vector<double> sums = SlotSeconds(layout, slots, seconds);
  return *std::max_element(sums.begin(), sums.end());
}

std::int64_t MovedVoxels(const Layout& from, const Layout& to) {
  const auto with_halo = [](const Layout& layout, std::size_t box) {
    return Grown(layout.partition.boxes()[box], kHalo, layout.partition.bounds());
  };
  std::map<std::uint32_t, std::vector<Box>> held;  // by slot
  for (std::size_t box = 0; box < from.owners.size(); ++box) {
    if (from.owners[box] != kNoSlot) held[from.owners[box]].push_back(with_halo(from, box));
  }
  std::int64_t moved = 0;
  for (std::size_t box = 0; box < to.owners.size(); ++box) {
    if (to.owners[box] == kNoSlot) continue;
    const Box wanted = with_halo(to, box);
    moved += Assemble(wanted, held[to.owners[box]], MostMissing(wanted)).missing_voxels();
  }
  return moved;
}

Layout Reassign(const Layout& layout, std::uint32_t slots, std::span<const double> seconds) {
  Layout changed = layout;
  std::vector<double> sums = SlotSeconds(layout, slots, seconds);
  for (std::size_t moves = 0; moves < seconds.size(); ++moves) {
    const auto most = std::max_element(sums.begin(), sums.end()), least = std::min_element(sums.begin(), sums.end());
    // The box that makes the two slots most alike; it must take less than their difference.
    const double half = (*most - *least) / 2;
    std::optional<std::size_t> best;
    for (std::size_t box = 0; box < seconds.size(); ++box) {
      if (changed.owners[box] != std::uint32_t(most - sums.begin()) || seconds[box] <= 0 || seconds[box] >= 2 * half) continue;
      if (!best || std::abs(seconds[box] - half) < std::abs(seconds[*best] - half)) best = box;
    }
    if (!best) break;
    changed.owners[*best] = std::uint32_t(least - sums.begin());
    *most -= seconds[*best];
    *least += seconds[*best];
  }
  return changed;
}

Layout CutByCost(const LayoutRequest& request, const Partition* resized) {
  ResolvedPolicy by_cost = *request.policy;
  by_cost.balance_by = BalanceBy::kCost;
  LayoutRequest cut = request;
  cut.policy = &by_cost;
  cut.resized = resized;
  return MakeLayout(cut);
}

std::optional<Layout> Rebalance(const BalanceRequest& asked) {
  const Layout& now = *asked.now;
  const LayoutRequest& request = *asked.make;
  CHECK(request.known.cost != nullptr);
  CHECK_GE(asked.frames_seen, 1);
  const double voxel_seconds = double(request.summary->types().bytes_per_voxel()) / calibration::service::kVoxelRate;
  const double least_gain = kLeastGain * (1 + 1.0 / asked.frames_seen);
  std::optional<Layout> chosen;
  double most_won = 0;
  const auto weigh = [&](Layout candidate, double before, double after) {
    const double won = kLasts * asked.frames_seen * (before - after) - double(MovedVoxels(now, candidate)) * voxel_seconds;
    if (before - after <= least_gain * before || won <= most_won) return;
    most_won = won;
    chosen = std::move(candidate);
  };

  Layout reassigned = Reassign(now, request.slots, asked.seconds);
  const double after_reassigning = FrameSeconds(reassigned, request.slots, asked.seconds);
  weigh(std::move(reassigned), FrameSeconds(now, request.slots, asked.seconds), after_reassigning);

  const auto predicted = [&](const Layout& layout) {
    return FrameSeconds(layout, request.slots, PredictedSeconds(layout, *request.known.cost));
  };
  const double before = predicted(now);
  Layout cut_anew = CutByCost(request, nullptr);
  const double after_cut = predicted(cut_anew);
  Layout resized = CutByCost(request, &now.partition);
  const double after_resizing = predicted(resized);
  weigh(std::move(resized), before, after_resizing);
  if (after_cut < (1 - kLeastGainOfNewBoxes) * after_resizing) weigh(std::move(cut_anew), before, after_cut);
  return chosen;
}

}  // namespace slabstream
