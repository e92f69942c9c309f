// The images plane: partial images between workers. Every worker binds a ROUTER; a sender connects a DEALER to it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/shared_arena.h"
#include "common/image/image_view.h"
#include "common/wire/control_messages.h"
#include "common/wire/ids.h"

namespace slabstream {

// One step of a group's schedule, carried out; or, with step == number of steps, the whole group image on its way from the root to the
// display worker. Payload: the runs, always Codec::kRaw; of a shared image the ColumnSpan of each row of its bounds.
// Pixels that stay in the sender's memory.
struct SharedImage {
  ArenaName arena;
  PixelBounds bounds;             // within the frame, not empty
  std::uint32_t stride = 0;       // pixels from row to row of a plane, [bounds.width(), kMaxFrameSide]
  std::uint64_t first_pixel = 0;  // of a plane: pixel (bounds.x_begin, bounds.y_begin), at most kMaxFramePixels
  std::vector<BlockName> planes;  // rgba; kDepth: and depth, voxel
  std::size_t rows() const { return std::size_t(bounds.height()); }
  friend bool operator==(const SharedImage&, const SharedImage&) = default;
};

struct PartialImage {
  Epoch epoch = 0;
  WorkerId from_worker = 0;
  GroupKey key;
  std::uint32_t step = 0;  // index into schedule.steps
  RankInterval interval;   // ranks whose images these pixels hold
  PixelRange pixels;       // of the frame, as in the step
  RunImageHeader image;    // of a shared image the format alone
  std::optional<SharedImage> shared;
  std::vector<RankReport> reports;  // of the ranks in `interval` that have not been passed on yet
  friend bool operator==(const PartialImage&, const PartialImage&) = default;
};

// To the sender of a shared image: it cannot be read here; these pixels, and all others from now on, are to come as runs.
struct ImageRefused {
  Epoch epoch = 0;
  WorkerId from_worker = 0;
  GroupKey key;
  std::uint32_t step = 0;
  PixelRange pixels;
  friend bool operator==(const ImageRefused&, const ImageRefused&) = default;
};

}  // namespace slabstream
