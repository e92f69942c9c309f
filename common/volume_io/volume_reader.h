// Volume files to volumes: NIfTI-1 (.nii, .nii.gz), NRRD (.nrrd; .nhdr with a detached data file; raw or gzip), MetaImage (.mhd, .mha; raw
// or zlib), and TIFF (a directory of slices, one file a slice, in natural order of their names; or one multi-page file). Truncated and
// damaged files are detected before memory is taken for them or while they are read. Reading takes memory for the bytes of the file's
// samples and, if samples become narrower, for the kept bytes on top.
//
// Samples are kept as uint8, uint16 or float32, without losing what was in the file: int8 and int16 are shifted into the unsigned type
// (ValueMapping.offset); uint32, int32, uint64, int64 and float64 become uint16 if all their values are integers that fit after a shift,
// else float32. If float32 cannot hold a value exactly, the reader logs a warning. A rescale slope and intercept (NIfTI scl_slope,
// scl_inter) goes into ValueMapping.
//
// Axes: if the file has an orientation (NIfTI sform or qform, NRRD space, MetaImage TransformMatrix), the voxels are turned to the nearest
// axes of its world, so that x runs to the patient's right (or along the world's x), y to anterior, z to superior, however they are stored.
// Slanted slices (a tilted gantry) are straightened. A matrix that is not finite or has no inverse is an error. Without an orientation x,
// y, z are the file's own index axes, first index fastest; spacing is its absolute value, where 0 and NaN become 1, with a warning. TIFF
// states no distance of slices: spacing is 1 along x and z, and along y the ratio of the two resolutions. Turning and straightening take
// memory for the kept bytes once more.
//
// All functions may be called from any thread.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/volume/volume.h"

namespace slabstream {

struct VolumeFileInfo {
  VolumeDescription description;
  std::string file_type;  // sample type in the file, such as "int16"
  std::string format;     // "NIfTI", "NRRD", "MetaImage", "TIFF"
  // As stored, before they were turned: voxels along each axis, and from a voxel to the next one along it, in the world.
  Index3 stored_size;
  std::array<Vec3, 3> steps;
  bool straightened = false;  // the stored axes are not at right angles
};

struct LoadedVolume {
  VolumeFileInfo info;
  std::shared_ptr<const Volume> volume;
};

// NotFound (no such file), InvalidArgument (not a volume, more than three dimensions, several components, a side above kMaxVolumeSide),
// DataLoss (truncated), ResourceExhausted (does not fit the memory). Messages name the path.
Result<LoadedVolume> ReadVolume(const std::string& path);

// Reads the headers alone, and checks what can be checked without the samples: sizes, types, the lengths of files, orientation. The files
// that ReadVolume would read: `path` and, if its header names one, the file of the samples. Errors: as ReadVolume.
Result<std::vector<std::string>> CheckVolumeHeaders(const std::string& path);

// Whether ReadVolume would try this path, by its ending or, for directories, by the TIFF files in it.
bool LooksLikeVolume(const std::string& path);

// Writes NRRD (gzip) or MetaImage (raw; .mhd: with a .raw beside it) by the ending. Such files have no value mapping: samples that were
// read from int8 or int16 become that type again, others with a mapping become float32 data values. An older file is replaced only by a
// complete one (common/base/files.h). InvalidArgument: another ending. Unavailable: cannot be written; the message says why.
Status WriteVolume(const Volume& volume, const std::string& path);

}  // namespace slabstream
