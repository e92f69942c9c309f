// Writes pictures to files, by the encoder of picture_encoder.h.
//
// PNG: straight alpha, 8 or 16 bit, row 0 at the top; code = round(max * clamp(straight value, 0, 1)), without a transfer curve.
// EXR: premultiplied linear float R, G, B, A, and Z (camera depth, +infinity where nothing is seen) for images that have depth.
// The file states the size of its pixels (PNG: chunk pHYs; EXR: xDensity)
// if that is one length all over the picture and its unit is known: for orthographic pictures of patients.
// The file appears whole or not at all (common/base/files.h).
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "client/image_io/composed_picture.h"
#include "common/base/status.h"
#include "common/image/picture_image.h"
#include "common/view/picture_geometry.h"

namespace slabstream {

// What a file holds beside the pixels.
struct PictureNotes {
  PictureGeometry geometry;
  std::vector<PictureGeometry> panes = {};  // of several pictures side by side, of equal widths; empty: it is one
  PictureKey key = {};
  std::string record;  // ASCII text that says how the picture was made, under the name kRecordName; empty: none
};
inline constexpr char kRecordName[] = "slabstream";

// Whether this file is a PNG that holds the codes of the picture itself: HoldsStraight8 of its format.
bool FileHoldsStraight8(const std::string& path, const PictureFormat& format);

// InvalidArgument, naming the path and the known endings, unless `path` ends in .png or .exr (any case).
Status CheckPicturePath(const std::string& path);

// The same, and Unavailable if libslabstream-pictures.so (picture_encoder.h) or a library that it needs is missing. To be called before the
// picture is made.
Status CheckCanWritePicture(const std::string& path);

// The bounds of `image` lie within `size`. Both formats are written row by row, so that writing
// needs no second copy of the picture. InvalidArgument: the path's ending. Unavailable: cannot be written; the message names the path.
// NotFound: the font of annotations.
Status WritePicture(const PictureImage& image, ImageSize size, const std::string& path, const PictureFormat& format,
                    const PictureNotes& notes = {});

// The bytes of the .png file that WritePicture would write. NotFound: the font of annotations.
Result<std::vector<std::byte>> PngFile(const PictureImage& image, ImageSize size, const PictureFormat& format,
                                       const PictureNotes& notes = {});

}  // namespace slabstream
