// ImageView: a read-only view of some pixels of an image, which lie in a local image or in another process' memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/image/local_image.h"
#include "common/image/run_image.h"

namespace slabstream {

struct ImageView {
  PixelFormat format = PixelFormat::kRgba;
  PixelBounds bounds;                    // within the frame; may be empty
  const float* rgba = nullptr;           // begins, like the others, at pixel (bounds.x_begin, bounds.y_begin); 4 floats a pixel
  const float* depth = nullptr;          // if the format has depths
  const std::uint32_t* voxel = nullptr;  // if the format has voxels
  std::size_t stride = 0;                // pixels from row to row, at least the bounds' width
  // One span for each row of the bounds, within the width. Pixels outside it are empty; their stored values do not matter.
  std::vector<ColumnSpan> rows;

  std::size_t pixel_bytes() const;  // bytes of a pixel in the spans' colours
};

// All pixels.
ImageView ViewOf(const LocalImage& image);

// The pixels that lie in `range` of a frame `frame_width` wide. The span of a row reaches from its first pixel that is not empty to its
// last one; the bounds are those of all spans. Only empty pixels at both ends of rows are read, so a dense image costs nothing.
ImageView ViewOf(const LocalImage& image, PixelRange range, std::int32_t frame_width);

// Removes pixels outside `range` from `view`, which lies in a frame `frame_width` wide.
void Clip(ImageView& view, PixelRange range, std::int32_t frame_width);

LocalImage CopyOf(const ImageView& view);  // with the view's rows

// The header of `view` as a dense image (run_image.h). Its payload is the colours where they are, from view.rgba on. None if rows are apart
// in memory, if the format has depths, or if a sample of the pixels suggests that so many are empty that runs are shorter.
std::optional<RunImageHeader> DenseHeader(const ImageView& view);

// Encodes the pixels of `view`; the header has its bounds. They are coded as `color` if that MayCode the format and all colours (ToCodes),
// else as floats.
RunImage EncodeRuns(const ImageView& view, ColorCoding color = ColorCoding::kFloat32, const Premultiplied& behind = {});

}  // namespace slabstream
