// Writes pictures to files, and to bytes of files, by the encoders of picture_encoder.h. What callers include of this folder.
//
// PNG, TIFF, WebP, PDF and SVG: straight alpha, row 0 at the top; code = round(max * clamp(straight value, 0, 1)), without a transfer
// curve, of 8 bits or in PNG and TIFF also of 16. JPEG: the same of 8 bits, over black as far as the picture is transparent. EXR:
// premultiplied linear float R, G, B, A, and Z (camera depth, +infinity where nothing is seen) for images that have depth. The file states
// the pixels an inch that PictureFormat says; without them the size of its pixels in the world, if that is one length all over the picture
// and its unit is known: for orthographic pictures of patients. (PNG: chunk pHYs; JPEG: JFIF and Exif; WebP: Exif; TIFF: XResolution; EXR:
// xDensity.) The page of a PDF or SVG has the size that follows from the pixels an inch, or else 72 of them. The file appears whole or not
// at all (common/files/files.h).
#pragma once

#include <atomic>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "client/pictures/composed_picture.h"
#include "client/pictures/picture_file_type.h"
#include "common/base/status.h"
#include "common/image/picture_image.h"
#include "common/view/picture_geometry.h"

namespace slabstream {

// What a file holds beside the pixels.
struct PictureNotes {
  PictureGeometry geometry;
  // The geometries of several pictures side by side, of equal widths; empty: it is one picture.
  std::vector<PictureGeometry> panes = {};
  PictureKey key = {};
  std::string record;  // ASCII text that says how the picture was made, under the name kRecordName; empty: none
};
inline constexpr char kRecordName[] = "slabstream";

// Whether this file is a PNG that holds the codes of the picture itself: HoldsStraight8 of its format.
bool FileHoldsStraight8(const std::string& path, const PictureFormat& format);

// For a message before the work begins: loads libslabstream-pictures.so if such a file needs it (picture_encoder.h), which takes a while.
// Errors of CheckPicturePath; Unavailable: the module or a library that it needs is missing.
Status CheckCanWritePicture(const std::string& path);

// The bounds of `image` lie within `size`. Most formats are written row by row, so that writing needs no second copy of the picture.
// InvalidArgument: CheckPictureFile. Unavailable: cannot be written; the message names the path. NotFound: the font of annotations.
Status WritePicture(const PictureImage& image, ImageSize size, const std::string& path, const PictureFormat& format,
                    const PictureNotes& notes = {});

// The bytes of the file that WritePicture would write. InvalidArgument: CheckPictureSize. NotFound: the font of annotations. Unavailable:
// as CheckCanWritePicture.
Result<std::vector<std::byte>> PictureFile(PictureFileType type, const PictureImage& image, ImageSize size, const PictureFormat& format,
                                           const PictureNotes& notes = {});

// A part of a picture as browsers take it, quickly: the pixels in `bounds`, which lies within the picture and is not empty. PNG: the codes
// that WritePicture stores, of 8 bits. JPEG of this quality: over black as far as the picture is transparent; colours have half the
// resolution, which takes two thirds of the time. nullopt: `given_up` became true meanwhile. Any thread.
std::optional<std::vector<std::byte>> EncodePart(PictureFileType type, const ComposedPicture& picture, const PixelBounds& bounds,
                                                 int quality, const std::atomic<bool>& given_up);

}  // namespace slabstream
