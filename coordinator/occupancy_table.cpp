#include "coordinator/occupancy_table.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"

namespace slabstream {

std::shared_ptr<const OccupancyGrid> OccupancyTable::Find(const ClassifiedVolume& volume) {
  const auto found = std::ranges::find(entries_, volume, &Entry::volume);
  if (found == entries_.end()) return nullptr;
  if (found->grid != nullptr) entries_.splice(entries_.begin(), entries_, found);
  return found->grid;
}

bool OccupancyTable::Counting(const ClassifiedVolume& volume) const {
  const auto found = std::ranges::find(entries_, volume, &Entry::volume);
  return found != entries_.end() && found->grid == nullptr;
}

CountId OccupancyTable::Begin(const ClassifiedVolume& volume) {
  CHECK(std::ranges::find(entries_, volume, &Entry::volume) == entries_.end());
  entries_.push_front({volume, ++last_count_, nullptr});
  return last_count_;
}

void OccupancyTable::Forget(DatasetId dataset) {
  entries_.remove_if([dataset](const Entry& entry) { return entry.volume.dataset() == dataset; });
}

std::size_t OccupancyTable::counting() const {
  return std::size_t(std::ranges::count_if(entries_, [](const Entry& entry) { return entry.grid == nullptr; }));
}

std::list<OccupancyTable::Entry>::iterator OccupancyTable::UnderWay(CountId count) {
  return std::ranges::find_if(entries_, [count](const Entry& entry) { return entry.grid == nullptr && entry.count == count; });
}

void OccupancyTable::Counted(CountId count, std::shared_ptr<const OccupancyGrid> grid) {
  CHECK(grid != nullptr);
  const auto found = UnderWay(count);
  if (found == entries_.end()) return;
  found->grid = std::move(grid);
  std::size_t kept = 0;
  entries_.remove_if([&kept](const Entry& entry) { return entry.grid != nullptr && ++kept > kMaxKept; });
}

std::optional<ClassifiedVolume> OccupancyTable::Failed(CountId count) {
  const auto found = UnderWay(count);
  if (found == entries_.end()) return std::nullopt;
  ClassifiedVolume volume = std::move(found->volume);
  entries_.erase(found);
  return volume;
}

}  // namespace slabstream
