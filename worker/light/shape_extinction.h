// The extinction of shapes (common/shapes/shape.h) on the grid of a light volume.
//
// A surface spreads over about two voxels. It takes its look's share of the light that meets it at a right angle, wherever it lies; like
// matter, more of light that comes slantwise. A tube or a ball takes that share along its diameter. One that is thinner than one and a half
// voxels is as thick as that, and takes as much of all light as if it were thin. Widths in pixels, which depend on the camera, count as one
// voxel here.
#pragma once

#include <memory>
#include <span>

#include "worker/light/extinction.h"

namespace slabstream {

// `bytes`: of each of setup.shapes, as PackShape made them; a shape without them is left out, and so are what is
// unlit and what lies outside the grid.
// Extinctions add up. Parallel; the result is the same for any number of threads and any instruction set.
void AddShapes(std::span<const std::shared_ptr<const VoxelBlock>> bytes, const FrameSetup& setup, Extinction& extinction);

}  // namespace slabstream
