#include "common/planning/frame_occlusion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace slabstream {

Status CheckFits(const OcclusionMask& mask, const FrameSetup& setup) {
  if (mask.empty()) return Status::Ok();
  if (!UsesOcclusion(setup)) return Status::InvalidArgument("a mask in a frame that uses none");
  const PixelBounds frame = FrameBounds(setup);
  const std::int32_t tiles_x = OcclusionTiles(frame.width()), tiles_y = OcclusionTiles(frame.height());
  if (mask.tiles_x == tiles_x && mask.tiles_y == tiles_y) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{} x {} tiles, but the frame has {} x {}", mask.tiles_x, mask.tiles_y, tiles_x, tiles_y));
}

PixelBounds ReachOf(const Box& box, const FrameSetup& setup) {
  const auto [c, u, v] = AxesOf(setup.camera.traversal_axis);
  const PixelBounds frame = FrameBounds(setup);
  // A box owns samples between its planes, and on the volume's rim those that footprints reach. Rows and columns are monotonic functions of
  // slice and voxel, so that the box's corners bound them.
  double left = frame.x_end, right = 0, top = frame.y_end, bottom = 0;
  for (const std::int32_t k : {box.begin[c], box.end[c] - 1}) {
    const SlicePlacement slice = PlaceSlice(setup.sheets, k);
    left = std::min(left, slice.scale_u * (box.begin[u] - kHalo) + slice.offset_u);
    right = std::max(right, slice.scale_u * (box.end[u] + kHalo) + slice.offset_u);
    top = std::min(top, slice.scale_v * (box.begin[v] - kHalo) + slice.offset_v);
    bottom = std::max(bottom, slice.scale_v * (box.end[v] + kHalo) + slice.offset_v);
  }
  const auto pixel = [](double x, std::int32_t count) { return std::int32_t(std::clamp(x, 0.0, double(count))); };
  return {pixel(std::floor(left), frame.x_end), pixel(std::floor(top), frame.y_end), pixel(std::ceil(right), frame.x_end),
          pixel(std::ceil(bottom), frame.y_end)};
}

bool HidesBox(const OcclusionMask& mask, const Box& box, const FrameSetup& setup) {
  return !mask.empty() && mask.HidesAll(ReachOf(box, setup));
}

}  // namespace slabstream
