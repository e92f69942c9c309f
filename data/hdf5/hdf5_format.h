// HDF5 files as sources: pyramids of Imaris and BigDataViewer, and datasets as images (hdf5_image.h).
#pragma once

#include <string>

#include "common/base/status.h"
#include "data/sources/chunked_source.h"
#include "data/volume_io/formats.h"

namespace slabstream {

VolumeFormat Hdf5();

// What the format opens a source of. Errors of VolumeFormat::open.
Result<Pyramid> ReadHdf5(const std::string& path, const ReadOptions& options, const SourceContext& context);

}  // namespace slabstream
