// LocalImage: the picture of some boxes, on the pixels that they can touch.
//
// Planes (pixel_format.h): interleaved float RGBA, 16 bytes a pixel, where empty is (0, 0, 0, 0); camera depths (float, empty is
// +infinity); voxel indices (the low 32 bits of the index of the voxel's face that is seen: FaceIndex in worker/kernels/surface_face.h),
// which break ties of depth (NearerDepth). Rows are stored top down without padding; pixel (x, y) is at index (y - bounds.y_begin) *
// bounds.width() + (x - bounds.x_begin).
#pragma once

#include <cstdint>
#include <vector>

#include "common/image/pixel_bounds.h"
#include "common/image/pixel_format.h"
#include "common/memory/pooled_vector.h"

namespace slabstream {

// Columns [begin, end) of one row, from the bounds' x_begin; begin == end: none.
struct ColumnSpan {
  std::uint32_t begin = 0, end = 0;
  friend constexpr bool operator==(const ColumnSpan&, const ColumnSpan&) = default;
};

struct LocalImage {
  PixelFormat format = PixelFormat::kRgba;
  PixelBounds bounds;                 // within the frame; may be empty
  PooledVector<float> rgba;           // 4 * pixel_count
  PooledVector<float> depth;          // pixel_count if the format has depths; else empty
  PooledVector<std::uint32_t> voxel;  // pixel_count if the format has voxels; else empty
  // Used while images are combined: pixels outside the span of their row are empty; their stored values do not matter. No spans: all pixels
  // are stored, as in images from renderers and in images that become pictures.
  std::vector<ColumnSpan> rows;
};

// All pixels empty.
LocalImage MakeLocalImage(PixelFormat format, const PixelBounds& bounds);
// The same, by spans: it has room for pixels, and nothing is written.
LocalImage MakeEmptyRows(PixelFormat format, const PixelBounds& bounds);
// Makes pixels [begin, end), by index, empty.
void MakeEmpty(LocalImage& image, std::size_t begin, std::size_t end);
// Stores the empty pixels outside `rows`, and drops the spans.
void FillRows(LocalImage& image);
// Pixels are uninitialised: for callers that write every one of them.
LocalImage MakeUnwrittenImage(PixelFormat format, const PixelBounds& bounds);

}  // namespace slabstream
