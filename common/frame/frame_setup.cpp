#include "common/frame/frame_setup.h"

#include <cmath>

#include "common/frame/frame_unit.h"

namespace slabstream {

VolumeGeometry WorldGeometryOf(const FrameSetup& setup) { return InUnit(setup.description.geometry, 1 / setup.unit); }

PictureGeometry PictureGeometryOf(const FrameSetup& setup) {
  PictureGeometry geometry = GeometryOf(setup.camera, setup.description.geometry);
  geometry.unit = UnitOf(WorldGeometryOf(setup));
  geometry.target = setup.unit * geometry.target;
  geometry.target_depth *= setup.unit;
  geometry.pixel_size *= setup.unit;
  geometry.box_corner = setup.unit * geometry.box_corner;
  for (Vec3& edge : geometry.box_edges) edge = setup.unit * edge;
  return geometry;
}

PixelBounds FrameBounds(const FrameSetup& setup) {
  return setup.sheets.empty() ? PixelBounds{0, 0, setup.camera.width, setup.camera.height}
                              : PixelBounds{0, 0, setup.sheets.width, setup.sheets.height};
}

std::int64_t FrameBytes(const FrameSetup& setup) { return FrameBounds(setup).pixel_count() * std::int64_t(BytesPerPixel(setup.format)); }

FrameArea ProjectBox(const Box& box, const FrameSetup& setup, std::int32_t before, std::int32_t behind) {
  FrameArea area;
  const auto add = [&area](double x, double y) { area.Add({x, y, x, y}); };
  if (!setup.sheets.empty()) {
    // Rows and columns are monotonic functions of slice and voxel, so the box's corners bound them.
    const auto [c, u, v] = AxesOf(setup.camera.traversal_axis);
    for (const std::int32_t k : {box.begin[c], box.end[c] - 1}) {
      const SlicePlacement slice = PlaceSlice(setup.sheets, k);
      add(slice.scale_u * (box.begin[u] - before) + slice.offset_u, slice.scale_v * (box.begin[v] - before) + slice.offset_v);
      add(slice.scale_u * (box.end[u] + behind) + slice.offset_u, slice.scale_v * (box.end[v] + behind) + slice.offset_v);
    }
    return area;
  }
  // Voxels are cells half a voxel to each side of their centres.
  const Vec3 half = {0.5, 0.5, 0.5};
  const Box place = setup.description.geometry.InDataSpace(box);
  const Camera::ImageExtent extent = setup.camera.ProjectBetween(ToVec3(place.begin) - half, ToVec3(place.end) - half);
  return {extent.x_begin, extent.y_begin, extent.x_end, extent.y_end};
}

// A box owns samples between its planes, and on the volume's rim those that footprints reach.
PixelBounds ReachOf(const Box& box, const FrameSetup& setup) {
  const PixelBounds frame = FrameBounds(setup);
  const FrameArea area = ProjectBox(box, setup, kHalo, kHalo);
  const auto pixel = [](double x, std::int32_t count) { return std::int32_t(std::clamp(x, 0.0, double(count))); };
  return {pixel(std::floor(area.x_begin), frame.x_end), pixel(std::floor(area.y_begin), frame.y_end),
          pixel(std::ceil(area.x_end), frame.x_end), pixel(std::ceil(area.y_end), frame.y_end)};
}

}  // namespace slabstream
