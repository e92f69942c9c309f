// From the frame that splatting renders (SheetGrid) to the picture: each pixel of the picture is a weighted mean of pixels of the frame
// round the point where its ray meets it.
//
// The weights are a quadratic B-spline in x and one in y, sampled at the centres of the frame's pixels and divided by their sum; pixels
// outside the image are empty. A spline is 3 pixels wide: pixels of the frame, or of the picture if those are wider, so that minified
// pictures do not alias. Weights are not negative and sum to 1, so an error of the frame never grows.
//
// Width of a spline in x, in pixels of the frame: s = max(1, |dX/d(x, y)| - kSkewSlack), the spline is 3 s wide. (In a skewed grid columns
// are denser than the gradient tells.)
#pragma once

#include <array>
#include <cstdint>

#include "common/image/local_image.h"

namespace slabstream {

inline constexpr double kSkewSlack = 0.25;  // pixels

// Fills the rows [y_begin, y_end) of `picture` (kRgba), within its bounds, from `frame` (kRgba). `frame_from_picture`: row-major projective
// map, (X, Y, W) = map (x, y, 1); pixels with W <= 0 are empty. What parts of a frame fill adds up to what the whole frame does. Any
// thread, disjoint rows.
using ProjectiveMap = std::array<double, 9>;
void ResampleRows(const LocalImage& frame, const ProjectiveMap& frame_from_picture, std::int32_t y_begin, std::int32_t y_end,
                  LocalImage& picture);

// Bounds of all pixels of a picture of width x height pixels that `frame` reaches, and some more.
PixelBounds ReachedPixels(const PixelBounds& frame, const ProjectiveMap& frame_from_picture, std::int32_t width, std::int32_t height);

}  // namespace slabstream
