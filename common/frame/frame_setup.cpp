#include "common/frame/frame_setup.h"

#include <algorithm>
#include <cmath>

namespace slabstream {
namespace {

// Bounds of points of the frame, cut to whole pixels of it.
struct Extent {
  double left, top, right = 0, bottom = 0;
  explicit Extent(const PixelBounds& frame) : left(frame.x_end), top(frame.y_end), frame_(frame) {}

  void Add(double x, double y) {
    left = std::min(left, x);
    right = std::max(right, x);
    top = std::min(top, y);
    bottom = std::max(bottom, y);
  }
  PixelBounds Pixels() const {
    const auto pixel = [](double x, std::int32_t count) { return std::int32_t(std::clamp(x, 0.0, double(count))); };
    return {pixel(std::floor(left), frame_.x_end), pixel(std::floor(top), frame_.y_end), pixel(std::ceil(right), frame_.x_end),
            pixel(std::ceil(bottom), frame_.y_end)};
  }

 private:
  const PixelBounds frame_;
};

// A box owns samples between its planes, and on the volume's rim those that footprints reach. Rows and columns are monotonic functions of
// slice and voxel, so the box's corners bound them.
void AddSlices(const Box& box, const FrameSetup& setup, Extent& extent) {
  const auto [c, u, v] = AxesOf(setup.camera.traversal_axis);
  for (const std::int32_t k : {box.begin[c], box.end[c] - 1}) {
    const SlicePlacement slice = PlaceSlice(setup.sheets, k);
    extent.Add(slice.scale_u * (box.begin[u] - kHalo) + slice.offset_u, slice.scale_v * (box.begin[v] - kHalo) + slice.offset_v);
    extent.Add(slice.scale_u * (box.end[u] + kHalo) + slice.offset_u, slice.scale_v * (box.end[v] + kHalo) + slice.offset_v);
  }
}

// Voxels are cells half a voxel to each side of their centres, and the projection of a convex box is bounded by its corners.
void AddCorners(const Box& box, const FrameSetup& setup, Extent& extent) {
  for (int corner = 0; corner < 8; ++corner) {
    const auto at = [&](Axis axis) { return ((corner >> Number(axis) & 1) != 0 ? box.end[axis] : box.begin[axis]) - 0.5; };
    const Camera::ImagePoint point = setup.camera.Project({at(Axis::kX), at(Axis::kY), at(Axis::kZ)});
    extent.Add(point.x, point.y);
  }
}

}  // namespace

PixelBounds FrameBounds(const FrameSetup& setup) {
  return setup.sheets.empty() ? PixelBounds{0, 0, setup.camera.width, setup.camera.height}
                              : PixelBounds{0, 0, setup.sheets.width, setup.sheets.height};
}

std::int64_t FrameBytes(const FrameSetup& setup) { return FrameBounds(setup).pixel_count() * std::int64_t(BytesPerPixel(setup.format)); }

PixelBounds ReachOf(const Box& box, const FrameSetup& setup) {
  Extent extent(FrameBounds(setup));
  if (setup.sheets.empty()) {
    AddCorners(box, setup, extent);
  } else {
    AddSlices(box, setup, extent);
  }
  return extent.Pixels();
}

}  // namespace slabstream
