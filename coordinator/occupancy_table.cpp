#include "coordinator/occupancy_table.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/base/check.h"

namespace slabstream {

std::shared_ptr<const OccupancyGrid> OccupancyTable::Find(const ClassifiedVolume& volume) {
  const auto found =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) { return entry.grid != nullptr && entry.volume == volume; });
  if (found == entries_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, found);
  return found->grid;
}

bool OccupancyTable::Counting(const ClassifiedVolume& volume) const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [&](const Entry& entry) { return entry.grid == nullptr && entry.volume == volume; });
}

CountId OccupancyTable::Begin(const ClassifiedVolume& volume) {
  CHECK(!Counting(volume));
  entries_.push_front({volume, ++last_count_, nullptr});
  return last_count_;
}

bool OccupancyTable::Counted(CountId count, std::shared_ptr<const OccupancyGrid> grid) {
  CHECK(grid != nullptr);
  const auto found =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) { return entry.grid == nullptr && entry.count == count; });
  if (found == entries_.end()) return false;
  found->grid = std::move(grid);
  auto kept = std::count_if(entries_.begin(), entries_.end(), [](const Entry& entry) { return entry.grid != nullptr; });
  for (auto entry = entries_.end(); kept > std::ptrdiff_t(kMaxKept);) {
    --entry;
    if (entry->grid == nullptr) continue;
    entry = entries_.erase(entry);
    --kept;
  }
  return true;
}

std::optional<ClassifiedVolume> OccupancyTable::Failed(CountId count) {
  const auto found =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) { return entry.grid == nullptr && entry.count == count; });
  if (found == entries_.end()) return std::nullopt;
  ClassifiedVolume volume = std::move(found->volume);
  entries_.erase(found);
  return volume;
}

}  // namespace slabstream
