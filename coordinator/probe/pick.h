// Pick: the point that a pixel of a picture shows. It lies on the pixel's ray, in the drawn part of the volume or on a shape
// beside it. The renderer's PickRule says which point:
//   kHalfOpacity (renderers that gather opacity)      the first point up to which the ray has met an opacity of one half
//                                                     or more, from the transfer function at trilinear samples, from
//                                                     isosurfaces, from labels as the frame shows them, and from shapes. None
//                                                     if the whole ray meets less
//   kSurface (renderers of opaque voxels)             where the ray enters the first opaque voxel of its pictures; or a shape
//                                                     nearer than that, up to which shapes have an opacity of one half or more
//   the largest or the least value                    the nearest sample with that value, of those in front of the first
//                                                     opaque shape. The projection is drawn over shapes. If it is less opaque
//                                                     than one half, the point is on the shape up to which projection and
//                                                     shapes have that opacity, if there is one
//   kMean, kNone (no sample has the value)            the shape that shows behind the projection in this way
// Shapes are opaque or take their share of the light that arrives, as in pictures (met_shapes.h). Clipping leaves them whole. Overlays do
// not count. Opacity is gathered in quarters of the least spacing, and the last step is divided further, so the point does not depend on
// the renderer's own samples. Light does not matter. The footprints of splatting are wider than these samples, so where its matter ends it
// may show some where nothing is picked.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "common/frame/frame_setup.h"
#include "common/shapes/packed_shape.h"
#include "coordinator/probe/probe_volume.h"

namespace slabstream {

struct Picked {
  Vec3 at;           // data space
  double depth = 0;  // in the setup's unit (common/view/camera.h)
  // That the pixel shows. Points of a surface lie between voxels, so where opacity is gathered it is the one that holds the point a
  // least spacing farther along the ray. Of a shape: that which holds the point, perhaps outside the volume.
  Index3 voxel = {};
  std::optional<std::uint32_t> shape = {};  // its number in FrameSetup::shapes; none: the pixel shows the volume
  std::optional<double> value = {};         // as MetShape::value
};

// x, y: pixels of the finished picture, from its upper left corner. `shapes`: of each of setup.shapes. Pure; may take milliseconds.
std::optional<Picked> Pick(const FrameSetup& setup, const ProbeVolume& volume, double x, double y, std::span<const ShapeView> shapes = {});

}  // namespace slabstream
