// What ImageJ and Fiji write into the description of the first page: lines such as channels=2, slices=7, frames=3, spacing=1.5,
// unit=micron.
#pragma once

#include <string>

#include "common/base/status.h"
#include "data/volume_io/page_layout.h"
#include "data/volume_io/tiff_file.h"

namespace slabstream {

// Whether a description is ImageJ's, or that of ImageJ2 (SCIFIO), which has the same lines.
bool IsImageJHeader(const std::string& description);

// `first`: the file at its first page, whose resolution is the size of pixels; `header`: of this page. InvalidArgument: a number of slices,
// channels or frames out of [1, kMaxVolumes], or another order than three different letters of c, z and t.
Result<PageLayout> ReadImageJHeader(const TiffFile& first, const RawHeader& header, const std::string& description);

}  // namespace slabstream
