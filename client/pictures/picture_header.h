// Reads what a PNG or EXR file says of itself, from its header alone.
//
// Such files may come from anywhere. So this is not left to OpenImageIO, whose EXR reader takes as much memory as a header asks for: here
// at most the first kMaxPictureHeaderBytes of a file are read, and nothing is allocated by a number in it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

inline constexpr std::size_t kMaxPictureHeaderBytes = std::size_t{4} << 20;

struct PictureHeader {
  std::string format;                   // "PNG", "EXR"
  std::uint32_t width = 0, height = 0;  // pixels, above 0
  std::vector<std::string> channels;    // PNG: "gray" or "R", "G", "B", and perhaps "A", or "palette"; EXR: as stored, sorted by name
  std::string sample_type;              // PNG: "uint1" to "uint16"; EXR: "half", "float", "uint32", or "mixed"
  std::optional<double> pixel_mm;       // side of a pixel, if the file states one and pixels are square
  std::string record;                   // kRecordName (picture_writer.h); empty: none
};

// Whether the path ends in .png or .exr (any case).
bool IsPicturePath(const std::string& path);

// NotFound: no such file. InvalidArgument: not a PNG or EXR file, damaged, or with a header that is too long. Messages name the path.
Result<PictureHeader> ReadPictureHeader(const std::string& path);

}  // namespace slabstream
