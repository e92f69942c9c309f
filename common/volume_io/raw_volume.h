// What a reader of one format makes of a file: a description of the volume, and the samples in the type that the file has.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/aligned_buffer.h"
#include "common/base/status.h"
#include "common/volume/volume.h"
#include "common/volume_io/payload.h"
#include "common/volume_io/sample_type.h"

namespace slabstream {

struct RawHeader {
  Index3 size;
  World world = World::kVoxels;
  // From a voxel to the next one along its x, y and z, in that world; kVoxels: the spacing along each axis. As in the file: may be zero or
  // NaN.
  std::array<Vec3, 3> steps = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
  Vec3 origin;                // of the centre of the first voxel
  std::string_view matrix{};  // the file's name for the steps, for messages; lives as long as the program
  SampleType type = SampleType::kUint8;
  ValueMapping rescale;  // from the file's samples to data values

  std::int64_t sample_bytes() const { return VolumeGeometry{size}.bounds().voxel_count() * std::int64_t(BytesPerSample(type)); }
};

struct RawVolume {
  RawHeader header;
  AlignedVector<std::byte> bytes;           // this machine's byte order; none if only headers were read
  std::filesystem::path samples_file = {};  // if that is another file than the header's
};

struct ReadOptions {
  bool headers_only = false;  // check whatever can be checked without the samples, and take no memory for them
};

// Steps along the axes themselves.
inline std::array<Vec3, 3> StepsOf(const Vec3& spacing) { return {Vec3{spacing.x, 0, 0}, Vec3{0, spacing.y, 0}, Vec3{0, 0, spacing.z}}; }

// From left, posterior, superior to right, anterior, superior, and back.
inline constexpr Vec3 kRasFromLps = {-1, -1, 1};

// A volume's size from what a file says of its dimensions; those of 1 behind the third are left out. InvalidArgument naming `path`: there
// are not three, or one is no whole number in [1, kMaxVolumeSide].
Result<Index3> ToSize(const std::string& path, std::vector<double> sizes);

// Checks that the file and the memory are large enough, then takes memory for the samples and reads them.
Result<RawVolume> ReadSamples(const std::string& path, const RawHeader& header, const Payload& payload, const ReadOptions& options);

// The formats. Errors as in volume_reader.h.
Result<RawVolume> ReadNifti(const std::string& path, const ReadOptions& options);
Result<RawVolume> ReadNrrd(const std::string& path, const ReadOptions& options);
Result<RawVolume> ReadMetaImage(const std::string& path, const ReadOptions& options);
Result<RawVolume> ReadTiff(const std::string& path, const ReadOptions& options);  // a multi-page file, or a directory of slices

// The TIFF files of a directory in natural order ("s2.tif" before "s10.tif"); empty if there are none or it is no directory.
std::vector<std::string> TiffFilesIn(const std::string& directory);

}  // namespace slabstream
