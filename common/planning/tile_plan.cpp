#include "common/planning/tile_plan.h"

#include <algorithm>
#include <map>
#include <utility>

#include "common/frame/shape_grid.h"
#include "common/planning/frame_plan.h"

namespace slabstream {
namespace {

// A number in [0, count).
std::size_t PlaceOf(std::uint32_t tile, const ShapeGrid& grid, std::size_t count) {
  constexpr std::uint32_t kAcross = 0xC13FA9A9, kDown = 0x91E10DA5;  // 2^32 / g and 2^32 / g^2, with g^3 = g + 1
  const std::uint32_t place = tile % grid.columns() * kAcross + tile / grid.columns() * kDown;
  return std::size_t(std::uint64_t{place} * count >> 32);
}

std::vector<WorkerId> Distinct(std::vector<WorkerId> workers) {
  std::ranges::sort(workers);
  workers.erase(std::ranges::unique(workers).begin(), workers.end());
  return workers;
}

}  // namespace

std::vector<TileOrder> PlanTiles(const FramePlan& plan) {
  if (plan.setup.shapes.empty()) return {};
  const ShapeGrid grid(FrameBounds(plan.setup));
  std::vector<std::vector<WorkerId>> needed(grid.count());  // by tile: the workers that need it
  std::vector<WorkerId> workers;
  for (const GroupPlan& group : plan.groups) {
    for (const Placement& placement : group.placements) {
      workers.push_back(placement.worker);
      grid.ForEach(ReachOf(placement.box, plan.setup), [&](std::uint32_t tile) { needed[tile].push_back(placement.worker); });
    }
  }
  workers = Distinct(std::move(workers));
  if (workers.empty()) return {};
  const std::vector<WorkerId> displays = DisplaysOf(plan.groups.front(), plan.display);
  for (std::size_t i = 0; i < displays.size(); ++i) {
    const PixelRange share = Share(WholeFrame(plan.setup), i, displays.size());
    if (share.begin == share.end) continue;
    grid.ForEach(RowsOf(share, grid.frame), [&](std::uint32_t tile) { needed[tile].push_back(displays[i]); });
  }
  std::map<std::pair<WorkerId, WorkerId>, std::vector<std::uint32_t>> orders;
  for (std::uint32_t tile = 0; tile < needed.size(); ++tile) {
    const WorkerId from = workers[PlaceOf(tile, grid, workers.size())];
    for (const WorkerId to : Distinct(std::move(needed[tile]))) {
      if (to != from) orders[{from, to}].push_back(tile);
    }
  }
  std::vector<TileOrder> result;
  for (auto& [order, tiles] : orders) result.push_back({order.first, order.second, std::move(tiles)});
  return result;
}

}  // namespace slabstream
