// The gateway's interface as an OpenAPI 3.0 document. Options come from the declarations that requests are parsed by.
#pragma once

#include "client/request/json_value.h"

namespace slabstream {

inline constexpr char kPixelXHelp[] = "Pixels from the left side of the whole picture; the first one's centre is at 0.5";
inline constexpr char kPixelYHelp[] = "Pixels from the upper side of the whole picture";
inline constexpr char kPointHelp[] = "A point of the world";
inline constexpr char kLineHelp[] = "An end of the line, a point of the world";
inline constexpr char kBoxHelp[] = "A box in the form of --clip-box; voxels whose centres lie in it or on its sides count";
inline constexpr char kWholeBox[] = ":,:,:";
inline constexpr int kProfileSamples = 256;

Json OpenApi();

// The options of pictures and slices, as DescribeOptions has them: {"render", "slice"}.
Json OfferedOptions();

}  // namespace slabstream
