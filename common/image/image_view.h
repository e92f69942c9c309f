// ImageView: some pixels of an image, wherever they lie, to be read: of a local image, or of another process' memory.
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
  const float* rgba = nullptr;           // of pixel (bounds.x_begin, bounds.y_begin), as all three; 4 floats a pixel
  const float* depth = nullptr;          // if the format has depths
  const std::uint32_t* voxel = nullptr;  // if the format has voxels
  std::size_t stride = 0;                // pixels from row to row, at least the bounds' width
  // bounds.height() of them, within the width: pixels of the bounds that are not in the span of their row are empty, whatever is stored.
  std::vector<ColumnSpan> rows;

  std::size_t pixel_bytes() const;  // of the spans' colours
};

// All pixels.
ImageView ViewOf(const LocalImage& image);

// The pixels that lie in `range` of a frame `frame_width` wide. The span of a row reaches from its first pixel that is not empty to its
// last one, the bounds are those of all spans. Only empty pixels at both ends of rows are looked at, so a dense image costs nothing.
ImageView ViewOf(const LocalImage& image, PixelRange range, std::int32_t frame_width);

// Leaves out of `view`, which lies in a frame `frame_width` wide, what is not in `range`.
void Clip(ImageView& view, PixelRange range, std::int32_t frame_width);

LocalImage CopyOf(const ImageView& view);  // with the view's rows

// The header of `view` as a dense image: its colours are the payload where they lie, from view.rgba on. None: they do not lie there row
// after row, there are depths, or more than a few pixels are empty (which a sample tells), so that runs are shorter.
std::optional<RunImageHeader> DenseHeader(const ImageView& view);

// The pixels of `view`, which lie in a frame, as they travel; bounds are the view's. Colours are coded as floats where `color` cannot: with
// depths, and where one of them cannot be coded (ToCodes).
RunImage EncodeRuns(const ImageView& view, ColorCoding color = ColorCoding::kFloat32);

}  // namespace slabstream
