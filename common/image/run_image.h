// RunImage: a local image with its empty pixels left out, the form that travels.
//
// Runs are maximal spans of non-empty pixels within a row, in row-major order; the pixels of all runs follow each other without gaps.
// Payload layout (little endian), also written down in docs/wire.md:
//   run_count * { u32 row offset from bounds.y_begin, u32 column offset from bounds.x_begin, u32 pixel count }
//   pixel_count * 4 * RGBA: f32, or as `color` says (u16 or u8)
//   formats with depths: pixel_count * f32 depth
//   formats with voxels: pixel_count * u32 voxel
// Dense: run_count == 0 and pixel_count > 0; the payload has no runs, but all pixels of the bounds, row by row.
// Empty: depth == +infinity; where the format has no depths, alpha == 0 (colour is then 0 too).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/status.h"
#include "common/image/local_image.h"
#include "common/image/run_header.h"
#include "common/image/straight_image.h"

namespace slabstream {

struct RunImage {
  RunImageHeader header;
  PooledVector<std::byte> payload;  // PayloadBytes(header)
};

// The pixels of `image` that lie in `range` of a frame `frame_width` wide; bounds are cut to the rows that the range touches. Bands of rows
// are encoded in parallel, within the caller's task arena.
RunImage EncodeRuns(const LocalImage& image, PixelRange range, std::int32_t frame_width);

// All pixels of a finished picture, for a client: without the voxel plane, and with bounds no larger than they must be. `color`: kFloat32,
// or kStraight8, which leaves the depths out, too, and codes the pixels over `behind`.
RunImage EncodePicture(const LocalImage& image, ColorCoding color = ColorCoding::kFloat32, const Premultiplied& behind = {});

// Checks an image from outside and makes its dense form, in one pass over the payload. InvalidArgument unless header and payload agree,
// runs ascend without touching, stay inside the bounds, and every colour and depth is finite. `frame` is the frame's whole rectangle. Rows
// are decoded in parallel, within the caller's task arena.
Result<LocalImage> ReadRuns(const RunImageHeader& header, std::span<const std::byte> payload, const PixelBounds& frame);

// Checks an image in the coding kStraight8 alike, and copies its codes into `image`, whose bounds contain the header's; its other pixels
// stay. The codes are those over image.behind.
Status ReadCodesInto(const RunImageHeader& header, std::span<const std::byte> payload, const PixelBounds& frame, StraightImage& image);

// The part of these checks that needs only the header: the image fits its frame, and so how much memory it may take.
Status ValidateRunHeader(const RunImageHeader& header, const PixelBounds& frame);
// All of them but the values of pixels: whoever reads those checks them (ValidatePixels).
Status ValidateRunTable(const RunImageHeader& header, std::span<const std::byte> payload, const PixelBounds& frame);

}  // namespace slabstream
