// Which worker draws which shape tiles of a frame (ShapeGrid). One of the workers that render the frame draws each tile and sends it to all
// that need it, to render or to display. A sequence of low discrepancy (R2; Roberts 2018) assigns them, so that each worker draws all over
// the frame.
//
// No picture depends on this: a worker that lacks a tile draws it, with the same result.
#pragma once

#include <cstdint>
#include <vector>

#include "common/planning/worker_id.h"

namespace slabstream {

struct FramePlan;

struct TileOrder {
  WorkerId from = 0, to = 0;         // `from` draws them for `to`, another one
  std::vector<std::uint32_t> tiles;  // numbers, ascending; not empty
  friend bool operator==(const TileOrder&, const TileOrder&) = default;
};

// Sorted by `from`, then `to`. Empty: no shapes, or one worker.
std::vector<TileOrder> PlanTiles(const FramePlan& plan);

}  // namespace slabstream
