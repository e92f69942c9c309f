// `convert` into a folder: an OME-Zarr with levels. A source that can be read in parts is never in memory as a whole.
#pragma once

#include <string>

#include "client/cli/options.h"
#include "common/base/status.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

// Whether `output` ends in .zarr.
bool NamesZarr(const std::string& output);

// `source` is what options.source says. A first Ctrl-C ends it with Cancelled, so that the same command goes on later.
Status ConvertToZarr(const ConvertOptions& options, const SourceText& source);

}  // namespace slabstream
