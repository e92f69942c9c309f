// What Python's tifffile writes into the description of the first page: the shape of the array, {"shape": [2, 7, 256, 256], "axes":
// "TZYX"}.
#pragma once

#include <optional>
#include <string>

#include "common/base/status.h"
#include "data/volume_io/page_layout.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {

// None: the description is not tifffile's, says nothing but the size of a page, or that of another page. Axes without names: z, y and x are
// the last ones; one before them is time, or the channel if `options` take one and no time; two are time and channel. An axis before z that
// is none of them counts as time. InvalidArgument, naming `path`: more axes.
Result<std::optional<PageLayout>> ReadTifffileHeader(const std::string& path, const std::string& description, const RawHeader& page,
                                                     const ReadOptions& options);

}  // namespace slabstream
