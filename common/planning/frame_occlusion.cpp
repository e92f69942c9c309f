#include "common/planning/frame_occlusion.h"

#include <fmt/format.h>

namespace slabstream {

Status CheckFits(const OcclusionMask& mask, const FrameSetup& setup) {
  if (mask.empty()) return Status::Ok();
  if (!UsesOcclusion(setup)) return Status::InvalidArgument("a mask in a frame that uses none");
  const PixelBounds frame = FrameBounds(setup);
  const std::int32_t tiles_x = OcclusionTiles(frame.width()), tiles_y = OcclusionTiles(frame.height());
  if (mask.tiles_x == tiles_x && mask.tiles_y == tiles_y) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{} x {} tiles, but the frame has {} x {}", mask.tiles_x, mask.tiles_y, tiles_x, tiles_y));
}

bool HidesBox(const OcclusionMask& mask, const Box& box, const FrameSetup& setup) {
  return !mask.empty() && mask.HidesAll(ReachOf(box, setup));
}

}  // namespace slabstream
