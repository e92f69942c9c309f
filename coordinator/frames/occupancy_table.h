// OccupancyTable: the occupied voxels of classified volumes, as far as plans need them. Counting reads all voxels, so the executor does it.
// Every count has an id of its own, so that late and repeated answers are recognised. The last few grids are kept.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>

#include "common/base/lru_map.h"
#include "common/planning/classified_volume.h"
#include "common/volume/occupancy_grid.h"

namespace slabstream {

using CountId = std::uint64_t;  // never given twice

class OccupancyTable {
 public:
  static constexpr std::size_t kMaxKept = 8;  // grids; counts under way are kept beside them

  // Null: not counted. A found grid counts as used; the least recently used goes first.
  std::shared_ptr<const OccupancyGrid> Find(const ClassifiedVolume& volume);
  bool Counting(const ClassifiedVolume& volume) const;
  CountId Begin(const ClassifiedVolume& volume);  // neither found nor counting
  std::size_t counting() const { return under_way_.size(); }
  std::size_t grids() const { return grids_.entries().size(); }

  // The end of a count. If there is none with this id under way, nothing changes.
  void Counted(CountId count, std::shared_ptr<const OccupancyGrid> grid);
  // The end of a count that failed. Returns its volume, whose count may be begun anew; none: there is no such count
  // under way.
  std::optional<ClassifiedVolume> Failed(CountId count);

  void Forget(DatasetId dataset);  // all grids of it, and counts under way

 private:
  std::map<CountId, ClassifiedVolume> under_way_;
  LruMap<ClassifiedVolume, std::shared_ptr<const OccupancyGrid>> grids_;
  CountId last_count_ = 0;
};

}  // namespace slabstream
