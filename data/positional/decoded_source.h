// Volumes that are decoded as a whole: pictures, DICOM, unstructured grids, and files whose voxels are straightened.
#pragma once

#include <memory>
#include <string>

#include "common/base/status.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/formats.h"

namespace slabstream {

// Reads the headers alone, as far as they tell the size of the volume; else decodes it, unless options.headers_only. Whoever reads a box
// first waits until all is decoded, and the source holds the samples; ReadLevel passes them on and holds none. options.progress, if any,
// must stay as long as the source is read. Errors as of OpenFile.
Result<std::shared_ptr<VolumeSource>> OpenDecoded(const VolumeFormat& format, const std::string& path, const ReadOptions& options);

}  // namespace slabstream
