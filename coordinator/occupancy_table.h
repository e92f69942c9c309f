// OccupancyTable: which voxels of the datasets a renderer draws under which transfer function, as far as plans need to know. Counting reads
// all voxels, so the executor does it; every count has an id of its own, so that an answer that comes late or twice is told apart. The last
// few grids are kept.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <optional>

#include "common/planning/frame_plan.h"
#include "common/volume/occupancy_grid.h"

namespace slabstream {

using CountId = std::uint64_t;  // never given twice

class OccupancyTable {
 public:
  static constexpr std::size_t kMaxKept = 8;  // grids; counts under way are kept beside them

  struct Subject {
    DatasetId dataset = 0;
    TransferFunction transfer;
    const RendererKind* renderer = nullptr;
    friend bool operator==(const Subject&, const Subject&) = default;
  };

  // Null: not counted. Whoever asks wants to keep it: the one asked for longest ago goes first.
  std::shared_ptr<const OccupancyGrid> Find(const Subject& subject);
  bool Counting(const Subject& subject) const;
  CountId Begin(Subject subject);  // neither found nor counting

  // The end of a count. False: there is none with this id under way; nothing changes.
  bool Counted(CountId count, std::shared_ptr<const OccupancyGrid> grid);
  // Likewise; what was counted. It may be begun anew.
  std::optional<Subject> Failed(CountId count);

 private:
  struct Entry {
    Subject subject;
    CountId count = 0;
    std::shared_ptr<const OccupancyGrid> grid;  // null: under way
  };
  std::list<Entry> entries_;  // asked for last first
  CountId last_count_ = 0;
};

}  // namespace slabstream
