// Volume files to volumes, and back; formats.h lists the formats. Truncated and damaged files are detected before memory is taken for them
// or while they are read. Reading takes memory for the bytes of the file's samples and, if samples become narrower, for the kept bytes on
// top.
//
// Samples are kept as uint8, uint16 or float32, without losing what was in the file: int8 and int16 are shifted into the unsigned type
// (ValueMapping.offset); uint32, int32, uint64, int64 and float64 become uint16 if all their values are integers that fit after a shift,
// else float32. LoadedVolume::exact has what float32 may round. A rescale slope and intercept (NIfTI scl_slope,
// scl_inter) goes into ValueMapping.
//
// Axes: if the file has an orientation (NIfTI sform or qform, NRRD space, MetaImage TransformMatrix), the voxels are turned to the nearest
// axes of its world, so that x runs to the patient's right (or along the world's x), y to anterior, z to superior, however they are stored.
// Slanted slices (a tilted gantry) are straightened; labels keep their values. A matrix that is not finite or has no inverse is an error.
// Without an orientation x, y, z are the file's own index axes, first index fastest; spacing is its absolute value, where 0 and NaN become
// 1, with a warning. A TIFF that neither OME nor ImageJ describes has spacing 1 along x and z, and along y the ratio of the two
// resolutions. Turning and straightening take memory for the samples once more.
//
// All functions may be called from any thread.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/base/status.h"
#include "common/volume/volume.h"
#include "data/volume_io/exact_samples.h"
#include "data/volume_io/file_samples.h"
#include "data/volume_io/read_options.h"
#include "data/volume_io/stated_label.h"

namespace slabstream {

struct VolumeFileInfo {
  VolumeDescription description;
  std::string file_type;  // sample type in the file, such as "int16"
  std::string format;     // the name in VolumeFormats(): "NIfTI"
  // As stored, before they were turned: voxels along each axis, and from a voxel to the next one along it, in the world.
  Index3 stored_size;
  std::array<Vec3, 3> steps;
  bool straightened = false;               // the stored axes are not at right angles
  bool labels = false;                     // samples are numbers of structures, not measurements
  std::vector<StatedLabel> looks = {};     // of labels, by ascending values, as far as the file says it
  std::vector<std::string> channels = {};  // of an image: names, "" where there is none; empty: there is one channel
  int channel = 0;                         // which of them it is
  int times = 1, time = 0;                 // how many volumes the file holds, and which of them it is
  // A sentence each, for people, of what the reader chose or applied where the file leaves it open, such as which of two matrices.
  std::vector<std::string> notes = {};
  std::vector<std::filesystem::path> other_files;  // that are read beside the path, or the folder of many
};

struct LoadedVolume {
  VolumeFileInfo info;
  std::shared_ptr<const Volume> volume;
  // As they are in the file, turned as the volume's, if their type is one that float32 may round; null: those of the volume are exact.
  std::shared_ptr<const ExactSamples> exact = {};
  bool rounded = false;  // float32 has rounded some of them in the volume
};

// NotFound (no such file), InvalidArgument (not a volume, an option that its format does not take, more than three dimensions, several
// components, a side above kMaxVolumeSide), DataLoss (truncated), ResourceExhausted (does not fit the memory). Messages name the path.
Result<LoadedVolume> ReadVolume(const std::string& path, const ReadOptions& options = {});

// Reads the headers alone, and checks what can be checked without the samples: sizes, types, the lengths of files, orientation. The files
// that ReadVolume would read: `path`, a file or a folder, and if its header names one, the file of the samples. Errors: as ReadVolume.
Result<std::vector<std::string>> CheckVolumeHeaders(const std::string& path, const ReadOptions& options = {});

// Whether ReadVolume would try this path: the file exists, a format knows it (formats.h), and takes the options. Errors as of ReadVolume.
Status CheckVolume(const std::string& path, const ReadOptions& options = {});
// The same without options, as for the files of a folder.
bool LooksLikeVolume(const std::string& path);

struct WriteOptions {
  std::optional<SampleType> type;  // of the samples in the file; none: see FileSamples
  WriteProgress progress;
  const ExactSamples* exact = nullptr;  // of the volume, which are written; null: there are none
};

// Writes the format that the ending names (formats.h; .mhd: with a .raw beside it). Files have no value mapping, but the data values
// themselves: samples that were read from int8 or int16 become that type again, others of a mapping by whole numbers the smallest integer
// type that holds them, and the rest float32. An older file is replaced only by a complete one (common/base/files.h). Takes a few MiB of
// memory. InvalidArgument: another ending, or a data value that does not fit options.type. Unavailable: cannot be written; the message says
// why.
Status WriteVolume(const Volume& volume, const std::string& path, const WriteOptions& options = {});

}  // namespace slabstream
