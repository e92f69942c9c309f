// Volume files as sources, by what their formats say of them (data/volume_io/formats.h):
//
//   samples in one piece, uncompressed    any box is read by position (StoredSamples)
//   the same in base64 or packed blocks   chunks of whole rows or slices are read and decoded (OpenPacked)
//   compressed, or in several files       read in order (SliceStream)
//   all others                            decoded as a whole (DecodedSource)
//
// Voxels are turned to the axes nearest to the world's as they are read. Samples in one piece are decoded as a whole, too, if their axes
// are not at right angles, or if the luminance of several components is wanted.
#pragma once

#include <memory>
#include <string>

#include "common/base/status.h"
#include "data/sources/read_context.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/formats.h"

namespace slabstream {

// `format` has `locate` or `read`, and knows the path and takes the options. Errors of OpenSource (data/open/open_source.h).
Result<std::shared_ptr<VolumeSource>> OpenFile(const VolumeFormat& format, const std::string& path, const ReadOptions& options,
                                               const SourceContext& context);

}  // namespace slabstream
