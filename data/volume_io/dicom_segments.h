// Segmentations of DICOM (PS3.3 C.8.20) as volumes: of a binary one and of a label map the numbers of the segments, as labels; of a
// fractional one the shares of a segment. Slices that the file leaves out are 0.
#pragma once

#include <string>

#include "common/base/status.h"
#include "data/volume_io/dicom_series.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {

// Whether every frame is of a segment that the file describes, and its pixels are such as a segmentation has. InvalidArgument, naming the
// file.
Status CheckSegments(const DicomImage& image);

// `series` has one image, which passed CheckSegments, and no trouble; `header` says all but type, rescaling, channels and labels.
// options.channel takes one of the segments, by their numbers in ascending order, except of a label map; a fractional segmentation shows
// the first one otherwise.
// InvalidArgument: two segments overlap, and the options take none; the message names both. Else errors of DicomFrameReader and TakeMemory.
Result<RawVolume> ReadSegments(const std::string& path, const DicomSeries& series, RawHeader header, const ReadOptions& options);

}  // namespace slabstream
