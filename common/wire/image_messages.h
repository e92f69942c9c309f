// The images plane: partial images between workers. Every worker binds a ROUTER; a sender connects a DEALER to it.
#pragma once

#include <cstdint>
#include <variant>
#include <vector>

#include "common/base/rare.h"
#include "common/combining/schedule.h"
#include "common/image/image_view.h"
#include "common/memory/shared_arena.h"
#include "common/stats/report.h"
#include "common/wire/encoded_runs.h"
#include "common/wire/ids.h"

namespace slabstream {

// Pixels that stay in the sender's memory.
struct SharedImage {
  ArenaName arena;
  PixelBounds bounds;             // within the frame, not empty
  std::uint32_t stride = 0;       // pixels from row to row of a plane, [bounds.width(), kMaxFrameSide]
  std::uint64_t first_pixel = 0;  // the place of pixel (bounds.x_begin, bounds.y_begin) in a plane, at most kMaxFramePixels
  std::vector<BlockName> planes;  // rgba; kDepth: and depth, voxel
  std::size_t rows() const { return std::size_t(bounds.height()); }
  friend bool operator==(const SharedImage&, const SharedImage&) = default;
};

// How the payload of an image's runs is packed.
struct PackedRuns {
  Codec codec = Codec::kZstd;  // not kRaw
  std::uint64_t bytes = 1;     // bytes of the payload, [1, PayloadBytes(image))
  std::uint64_t digest = 0;    // XXH3-64 of the payload
  friend bool operator==(const PackedRuns&, const PackedRuns&) = default;
};

// Payloads with fewer bytes are not acknowledged: they measure a link's latency rather than its rate.
inline constexpr std::size_t kLeastAcknowledgedBytes = std::size_t{64} << 10;

// One step of a group's schedule, carried out; or, with step == number of steps, the whole group image on its way from the root to the
// display worker. Payload: the runs, raw unless `packed`; of a shared image, the ColumnSpan of each row of its bounds.
struct PartialImage {
  Epoch epoch = 0;
  WorkerId from_worker = 0;
  GroupKey key;
  std::uint32_t step = 0;  // index into schedule.steps
  RankInterval interval;   // ranks whose images these pixels hold
  PixelRange pixels;       // pixels of the frame, as in the step
  RunImageHeader image;    // for a shared image, only its format counts
  Rare<SharedImage> shared;
  Rare<PackedRuns> packed;          // not of a shared image
  std::uint64_t acknowledge = 0;    // not 0: the sender waits for ImageReceived with this number
  std::vector<RankReport> reports;  // reports of the ranks in `interval` that have not been passed on yet
  friend bool operator==(const PartialImage&, const PartialImage&) = default;
};

// To the sender of an image that asked for it (`acknowledge`): the image has arrived.
struct ImageReceived {
  Epoch epoch = 0;
  WorkerId from_worker = 0;
  std::uint64_t number = 1;  // not 0
  friend bool operator==(const ImageReceived&, const ImageReceived&) = default;
};

// To the sender of a shared image: it cannot be read here. Send these pixels, and all others from now on, as runs.
struct ImageRefused {
  Epoch epoch = 0;
  WorkerId from_worker = 0;
  GroupKey key;
  std::uint32_t step = 0;
  PixelRange pixels;
  friend bool operator==(const ImageRefused&, const ImageRefused&) = default;
};

using WorkerToWorker = std::variant<PartialImage, ImageRefused, ImageReceived>;

}  // namespace slabstream
