// ReadVolume: a volume in memory, which is level 0 of its source (open_source.h). Truncated and damaged files are detected before memory is
// taken for them or while they are read. Reading takes memory for the kept samples; formats that are decoded as a whole
// (SourceInfo::whole) take it for the samples of the file and, if samples become narrower or are turned, for those on top.
//
// Samples are kept as uint8, uint16 or float32, without losing what was in the file: int8 and int16 are shifted into the unsigned type
// (ValueMapping.offset); uint32, int32, uint64, int64 and float64 become uint16 if all their values are integers that fit after a shift,
// else float32. LoadedVolume::exact has what float32 may round. A rescale slope and intercept (NIfTI scl_slope, scl_inter) goes into
// ValueMapping.
//
// Axes: if the file has an orientation (NIfTI sform or qform, NRRD space, MetaImage TransformMatrix), the voxels are turned to the nearest
// axes of its world, so that x runs to the patient's right (or along the world's x), y to anterior, z to superior, however they are stored.
// Slanted slices (a tilted gantry) are straightened; labels keep their values. A matrix that is not finite or has no inverse is an error.
// Without an orientation x, y, z are the file's own index axes, first index fastest; spacing is its absolute value, where 0 and NaN become
// 1, with a warning. A TIFF that neither OME nor ImageJ describes has spacing 1 along x and z, and along y the ratio of the two
// resolutions.
//
// Any thread.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

struct LoadedVolume : LevelInMemory {
  SourceInfo info;  // its finest level is the volume's description
};

// Reads options.time, or else the first one if options.describe. Logs what PartTexts says. Errors of OpenSource and
// VolumeSource::ReadLevel.
Result<LoadedVolume> ReadVolume(const std::string& path, const ReadOptions& options = {}, bool all_exact = false);
// The finest level of a source that was opened with these options, narrow in any case. Logs nothing.
Result<LoadedVolume> ReadVolume(VolumeSource& source, const std::string& path, const ReadOptions& options, LevelWanted wanted = {});

// The headers alone: the files that are read, `path` first, and if its header names one, the file of the samples; for many the folder.
// Errors of OpenSource.
Result<std::vector<std::string>> CheckVolumeHeaders(const std::string& path, const ReadOptions& options = {});

// A line, which begins with `path`, for each choice among times, channels and components that the options leave open.
std::vector<std::string> PartTexts(const std::string& path, const ReadOptions& options, const SourceInfo& info);
void WarnOfPart(const std::string& path, const ReadOptions& options, const SourceInfo& info);

}  // namespace slabstream
