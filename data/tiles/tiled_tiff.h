// TIFF, BigTIFF and OME-TIFF files as sources: each slice is a page (tiff_stack.h), and its tiles, or some strips, are chunks. Smaller
// pictures of the pages are the coarser levels: their sub-directories (SubIFDs, as OME-TIFF and Bio-Formats write them), or pages of
// reduced resolution that follow them.
//
// The volume is that of ReadVolume, with one difference (chunked_source.h): integers of more than 16 bits and float64 become float32. The
// corners of all levels coincide.
#pragma once

#include <memory>
#include <string>

#include "common/base/status.h"
#include "data/sources/read_context.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

// VolumeFormat::open of TIFF: reads the directories of all pages. Null: a folder of slices, or the luminance of several components, which
// are decoded as a whole.
Result<std::shared_ptr<VolumeSource>> OpenTiff(const std::string& path, const ReadOptions& options, const SourceContext& context);

}  // namespace slabstream
