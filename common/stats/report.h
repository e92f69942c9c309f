// What a worker measured while it rendered and combined one rank of one group. Reports travel with the partial images, so that the display
// worker has all of them when the frame is complete, without another message that could be lost.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "common/image/pixel_bounds.h"

namespace slabstream {

enum class Stage : std::uint8_t {
  kFetch = 0,    // waiting for voxels (from the first chunk request to the last chunk stored)
  kPrepare = 1,  // classification, normals, occupied runs: once per padded box and transfer function
  kTransform = 2,
  kShade = 3,
  kSplat = 4,
  kComposite = 5,  // sheets into the local image
  kZBuffer = 6,
  kCombine = 7,  // local images of ranks into the group image
  kEncode = 8,   // images into runs and payload bytes
  kResolve = 9,  // supersampled frame to final pixels
  kRender = 10,  // one rank from start to end: contains kPrepare ... kZBuffer and kSample
  kSample = 11,  // samples along rays: interpolated, classified, shaded, composited
};
inline constexpr int kStageCount = 12;
std::string_view ToString(Stage stage);  // "transform": names of --stats and --trace

using StageTimes = std::array<std::int64_t, kStageCount>;  // ns, worker time by stage
void AddTimes(StageTimes& sum, const StageTimes& times);

// One stretch of time on one thread of a worker. On the clock of MonotonicNow().
struct Span {
  Stage stage = Stage::kRender;
  std::int64_t begin_ns = 0, end_ns = 0;
  friend bool operator==(const Span&, const Span&) = default;
};

struct RankReport {
  std::uint32_t worker = 0;
  std::uint32_t group = 0;
  std::uint32_t rank = 0;
  std::uint32_t box = 0;
  StageTimes stage_ns{};
  std::vector<Span> spans;            // at most kMaxSpans
  std::uint64_t occupied_voxels = 0;  // in the box, under this transfer function
  std::uint64_t drawn_voxels = 0;     // voxels that went through splat or Z-buffer
  std::uint64_t voxel_bytes = 0;      // received for this group since the last report (0: all was cached)
  std::uint64_t image_bytes = 0;      // payload sent to other workers
  PixelBounds image_bounds;           // pixels of the box's own image, in the frame
  std::uint64_t image_pixels = 0;     // pixels in image_bounds that are not empty: an estimate (SamplePixels)
  std::uint64_t stored_bytes = 0;     // read from the dataset's source for what was received, as they are stored (Chunk::stored_bytes)
  std::uint64_t sent_bytes = 0;       // on the voxels plane, of what was received: 0 if the worker reads all of it itself
  friend bool operator==(const RankReport&, const RankReport&) = default;
};
inline constexpr int kMaxSpans = 64;

// Adds a stretch of time to the stage; its span only while there is room.
void AddStage(RankReport& report, Stage stage, std::int64_t begin_ns, std::int64_t end_ns);

// The time to make and encode the picture, in ns, from the display worker's report. Earlier encoding of partial images does not count.
std::int64_t PictureNs(const RankReport& report);

}  // namespace slabstream
