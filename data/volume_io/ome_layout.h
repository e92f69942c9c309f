// Where the planes of an OME image lie: in the pages of one TIFF file, or of several in one folder.
#pragma once

#include <string>

#include "common/base/status.h"
#include "data/volume_io/page_layout.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

// The description of the first page of a TIFF file, or all of a file of OME metadata (.companion.ome, .ome.xml). Errors of TiffFile::Open
// and ReadTextFile.
Result<std::string> DescriptionIn(const std::string& path);

// `path`: the file that has the description; files that this one names are looked for in its folder, and only there.
// Lengths are converted to micrometres. If there are several images, options.series says which one, from 0; without it,
// the first one is taken. InvalidArgument, naming `path`: no XML; sizes out of [1, kMaxVolumes]; an unknown
// DimensionOrder; an image that is not there. NotFound: the description is in another file, which is missing.
Result<PageLayout> ReadOmeLayout(const std::string& path, const std::string& description, const ReadOptions& options);

}  // namespace slabstream
