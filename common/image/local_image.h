// LocalImage: the picture of some boxes, on the pixels that they can touch.
//
// Three pixel formats. kRgba (splatting): premultiplied float RGBA, interleaved, 16 bytes a pixel; empty is (0, 0, 0, 0).
// kDepth (Z-buffer): the same RGBA (alpha 0 or 1) with a depth plane (float, camera depth; empty is +infinity) and a voxel plane (the low
// 32 bits of the index of the voxel's face that is seen: FaceIndex in worker/kernels/surface_face.h), which breaks ties of depth: see
// NearerDepth. kRgbaDepth is what is left of kDepth in a finished picture, which meets no other image: it has no voxel plane. Rows are
// stored top down without padding; pixel (x, y) is at index (y - bounds.y_begin) * bounds.width() + (x - bounds.x_begin).
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "common/base/pooled_vector.h"

namespace slabstream {

enum class PixelFormat : std::uint8_t { kRgba = 1, kDepth = 2, kRgbaDepth = 3 };

constexpr bool HasDepth(PixelFormat format) { return format != PixelFormat::kRgba; }
constexpr bool HasVoxel(PixelFormat format) { return format == PixelFormat::kDepth; }

// Half-open pixel rectangle.
struct PixelBounds {
  std::int32_t x_begin = 0, y_begin = 0, x_end = 0, y_end = 0;

  constexpr std::int32_t width() const { return x_end - x_begin; }
  constexpr std::int32_t height() const { return y_end - y_begin; }
  constexpr bool empty() const { return x_end <= x_begin || y_end <= y_begin; }
  constexpr std::int64_t pixel_count() const { return empty() ? 0 : std::int64_t(width()) * height(); }
  constexpr bool Contains(const PixelBounds& b) const {
    return b.empty() || (b.x_begin >= x_begin && b.y_begin >= y_begin && b.x_end <= x_end && b.y_end <= y_end);
  }
  friend constexpr bool operator==(const PixelBounds&, const PixelBounds&) = default;
};

constexpr PixelBounds Intersection(const PixelBounds& a, const PixelBounds& b) {
  return {std::max(a.x_begin, b.x_begin), std::max(a.y_begin, b.y_begin), std::min(a.x_end, b.x_end), std::min(a.y_end, b.y_end)};
}
constexpr PixelBounds Union(const PixelBounds& a, const PixelBounds& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {std::min(a.x_begin, b.x_begin), std::min(a.y_begin, b.y_begin), std::max(a.x_end, b.x_end), std::max(a.y_end, b.y_end)};
}

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
  // While images are combined: pixels that are not in the span of their row are empty, whatever is stored. No spans: all pixels are stored,
  // as in all images that renderers make and that pictures are made from.
  std::vector<ColumnSpan> rows;
};

// All pixels empty.
LocalImage MakeLocalImage(PixelFormat format, const PixelBounds& bounds);
// Pixels [begin, end) by index.
void MakeEmpty(LocalImage& image, std::size_t begin, std::size_t end);
// Stores the empty pixels that `rows` left out.
void FillRows(LocalImage& image);
// Pixels hold anything: for who writes every one of them.
LocalImage MakeUnwrittenImage(PixelFormat format, const PixelBounds& bounds);

}  // namespace slabstream
