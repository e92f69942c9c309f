// Which worker draws which tiles of a frame's shapes (ShapeGrid). Each tile is drawn once, by one of the workers that render the frame, and
// sent to all that need it, to render or to display. Tiles follow a sequence of low discrepancy (R2; Roberts 2018), so that a worker gets
// tiles from everywhere in the frame.
//
// Nothing depends on it: a worker that does not get a tile draws it, with the same result.
#pragma once

#include <cstdint>
#include <vector>

#include "common/planning/worker_id.h"

namespace slabstream {

struct FramePlan;

struct TileOrder {
  WorkerId from = 0, to = 0;         // not the same: draws them, and gets them
  std::vector<std::uint32_t> tiles;  // numbers, ascending; not empty
  friend bool operator==(const TileOrder&, const TileOrder&) = default;
};

// By `from` and `to`. None: the frame has no shapes, or one worker.
std::vector<TileOrder> PlanTiles(const FramePlan& plan);

}  // namespace slabstream
