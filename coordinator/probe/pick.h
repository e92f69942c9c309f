// Pick: the point of the world that a pixel of a picture shows. It lies on the pixel's ray through the drawn part of the
// volume. The renderer's PickRule says which point:
//   kHalfOpacity (renderers that gather opacity)      the first point up to which the ray has met an opacity of one half
//                                                     or more, from the transfer function at trilinear samples, from
//                                                     isosurfaces, and from labels as the frame shows them. None if the
//                                                     whole ray meets less
//   kSurface (renderers of opaque voxels)             where the ray enters the first opaque voxel of its pictures
//   the largest or the least value                    the nearest sample with that value
// Overlays do not count. Opacity is gathered in quarters of the least spacing, and the last step is divided further, so the point does not
// depend on the renderer's own samples. Light does not matter. The footprints of splatting are wider than these samples, so where its
// matter ends it may show some where nothing is picked.
#pragma once

#include <optional>

#include "common/frame/frame_setup.h"
#include "coordinator/probe/probe_volume.h"

namespace slabstream {

struct Picked {
  Vec3 at;           // data space
  double depth = 0;  // in the setup's unit (common/view/camera.h)
  // That the pixel shows. Points of a surface lie between voxels, so where opacity is gathered it is the one that holds the point a
  // least spacing farther along the ray.
  Index3 voxel = {};
};

// x, y: pixels of the finished picture, from its upper left corner. Pure; may take milliseconds.
std::optional<Picked> Pick(const FrameSetup& setup, const ProbeVolume& volume, double x, double y);

}  // namespace slabstream
