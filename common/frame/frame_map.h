// FrameMap: from data space to the pixels and depths of a frame, and back along rays; the same for frames of the camera and for those along
// slices. There depths are slices, counted so that they grow away from the eye: k if the traversal ascends, else -k. With (p, 1) a point of
// data space:
//   w = Dot(w, (p, 1)); column = Dot(x, (p, 1)) / w; row = Dot(y, (p, 1)) / w; depth = Dot(depth, (p, 1)); w = w_per_depth * depth + w_0
// Orthographic: w = 1.
#pragma once

#include <algorithm>
#include <array>

#include "common/frame/frame_setup.h"
#include "common/math/row4.h"

namespace slabstream {

struct FrameMap {
  Row4 x{}, y{}, w{}, depth{};
  double w_per_depth = 0, w_0 = 1;
  double least_w = 0;                                  // nothing is seen nearer to the eye
  double merged_depth = 0, merged_depth_of_pixel = 0;  // MergedAt: the larger one of the first, and of the second times w
  // Columns of the inverse of (x, y, depth): point = steps[0] * (column * w - x[3]) + ...
  std::array<Vec3, 3> steps;

  bool perspective() const { return w_per_depth != 0; }
  // What is linear on the screen and grows with depth: depth, or -1 / w.
  double KeyOf(double at_depth) const { return perspective() ? -1 / (w_per_depth * at_depth + w_0) : at_depth; }
  double DepthOf(double key) const { return perspective() ? (-1 / key - w_0) / w_per_depth : key; }
  bool Sees(double at_depth) const { return w_per_depth * at_depth + w_0 > least_w; }
  // Surfaces of one shape that are nearer to each other are one: half of what a voxel extends in depth, or twice the width of a pixel
  // there, whichever is more. So those that turn away from the eye by up to about 70 degrees are one.
  double MergedAt(double at_depth) const { return std::max(merged_depth, merged_depth_of_pixel * (w_per_depth * at_depth + w_0)); }
  // The points origin + depth * direction lie at this point of the frame.
  struct Ray {
    Vec3 origin, direction;
  };
  Ray RayAt(double column, double row) const {
    return {(column * w_0 - x[3]) * steps[0] + (row * w_0 - y[3]) * steps[1] - depth[3] * steps[2],
            column * w_per_depth * steps[0] + row * w_per_depth * steps[1] + steps[2]};
  }
};

FrameMap MakeFrameMap(const FrameSetup& setup);
FrameMap MakeFrameMap(const Camera& camera);  // of the camera's own frame

}  // namespace slabstream
