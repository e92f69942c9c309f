// MeetShapes: where the ray of a pixel meets the shapes of its picture, on the surfaces that the picture draws (worker/shapes). The picture
// also measures how much of a pixel an edge covers; a ray meets a surface or misses it.
//
// A ray that meets the border of two triangles, or a vertex, meets one of them. Pieces of a line that it meets where they are joined are
// one surface, as in pictures.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/frame/frame_setup.h"
#include "common/shapes/packed_shape.h"

namespace slabstream {

struct MetShape {
  double depth = 0;                  // of the camera: in the setup's unit
  std::uint32_t shape = 0;           // its number in FrameSetup::shapes
  double opacity = 1;                // (0, 1]: the share of the arriving light that it takes
  std::optional<double> value = {};  // that its vertices have, interpolated; none: they have none there
};

// The nearest one comes first, and only the last one may be opaque. `shapes`: the shape of each of setup.shapes, in their order. `ray`: of
// setup.camera. Pure; takes about a millisecond for a million triangles.
std::vector<MetShape> MeetShapes(const FrameSetup& setup, std::span<const ShapeView> shapes, const Camera::Ray& ray);

}  // namespace slabstream
