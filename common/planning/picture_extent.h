// Where a box of voxels lies in a picture.
#pragma once

#include "common/view/camera.h"
#include "common/volume/box.h"
#include "common/volume/grid_map.h"

namespace slabstream {

// The image of the cells of a box of voxels, or of several neighbouring ones: half a voxel around their centres. `map`
// leads to the camera's grid.
inline Camera::ImageExtent ExtentOf(const Box& box, const GridMap& map, const Camera& camera) {
  Vec3 low, high;
  for (const Axis axis : kAxes) {
    low[axis] = map.To(box.begin[axis] - 0.5, axis);
    high[axis] = map.To(box.end[axis] - 0.5, axis);
  }
  return camera.ProjectBetween(low, high);
}

// Whether the picture may show some of it: a pixel more on all sides is taken for the picture.
inline bool InPicture(const Camera::ImageExtent& extent, const Camera& camera) {
  constexpr double kSlack = 1;  // pixels
  return extent.x_end > -kSlack && extent.y_end > -kSlack && extent.x_begin < camera.width + kSlack &&
         extent.y_begin < camera.height + kSlack;
}

}  // namespace slabstream
