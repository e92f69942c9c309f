#include "coordinator/frames/occupancy_table.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"

namespace slabstream {

std::shared_ptr<const OccupancyGrid> OccupancyTable::Find(const ClassifiedVolume& volume) {
  const auto* const grid = grids_.Find(volume);
  return grid == nullptr ? nullptr : *grid;
}

bool OccupancyTable::Counting(const ClassifiedVolume& volume) const {
  return std::ranges::any_of(under_way_, [&](const auto& count) { return count.second == volume; });
}

CountId OccupancyTable::Begin(const ClassifiedVolume& volume) {
  CHECK(grids_.Find(volume) == nullptr && !Counting(volume));
  under_way_.emplace(++last_count_, volume);
  return last_count_;
}

void OccupancyTable::Forget(DatasetId dataset) {
  std::erase_if(under_way_, [dataset](const auto& count) { return count.second.dataset() == dataset; });
  grids_.DropIf([dataset](const auto& entry) { return entry.key.dataset() == dataset; });
}

void OccupancyTable::Counted(CountId count, std::shared_ptr<const OccupancyGrid> grid) {
  CHECK(grid != nullptr);
  const auto counted = under_way_.extract(count);
  if (counted.empty()) return;
  grids_.Put(counted.mapped(), std::move(grid));
  grids_.DropBeyond(kMaxKept);
}

std::optional<ClassifiedVolume> OccupancyTable::Failed(CountId count) {
  auto failed = under_way_.extract(count);
  return failed.empty() ? std::nullopt : std::optional(std::move(failed.mapped()));
}

}  // namespace slabstream
