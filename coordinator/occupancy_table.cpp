#include "coordinator/occupancy_table.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/base/check.h"

namespace slabstream {

std::shared_ptr<const OccupancyGrid> OccupancyTable::Find(const Subject& subject) {
  const auto found =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) { return entry.grid != nullptr && entry.subject == subject; });
  if (found == entries_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, found);
  return found->grid;
}

bool OccupancyTable::Counting(const Subject& subject) const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [&](const Entry& entry) { return entry.grid == nullptr && entry.subject == subject; });
}

CountId OccupancyTable::Begin(Subject subject) {
  CHECK(!Counting(subject));
  entries_.push_front({std::move(subject), ++last_count_, nullptr});
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

std::optional<OccupancyTable::Subject> OccupancyTable::Failed(CountId count) {
  const auto found =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) { return entry.grid == nullptr && entry.count == count; });
  if (found == entries_.end()) return std::nullopt;
  Subject subject = std::move(found->subject);
  entries_.erase(found);
  return subject;
}

}  // namespace slabstream
