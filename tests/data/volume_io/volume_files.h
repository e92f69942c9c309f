// Volume files written byte by byte from the formats' definitions, so that the readers are not tested against a library's idea of them.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/math/vec.h"
#include "common/volume/volume.h"
#include "data/volume_io/sample_type.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {

using FileBytes = std::string;

FileBytes Gzip(const FileBytes& bytes);  // one gzip member
FileBytes Zlib(const FileBytes& bytes);

// Values as samples of a type in the file's byte order; each value must fit.
FileBytes EncodeSamples(SampleType type, const std::vector<double>& values, bool big_endian = false);

struct FileSpec {
  Index3 size = {4, 3, 2};
  SampleType type = SampleType::kUint8;
  bool big_endian = false;
  Vec3 spacing = {1, 1, 1};
  float slope = 1, intercept = 0;     // NIfTI only
  std::int16_t qform = 0, sform = 0;  // NIfTI only: codes
  // NIfTI only: a quarter turn about z, from (1, 2, 3); the matrix swaps y and z, from (4, 5, 6).
  std::array<float, 6> quaternion = {0, 0, 0.70710678F, 1, 2, 3};
  float qfac = 1;
  std::array<float, 12> matrix = {2, 0, 0, 4, 0, 0, 2, 5, 0, 2, 0, 6};
  std::vector<std::int16_t> dimensions;  // NIfTI only: dim[1] ... instead of `size`
};

FileBytes NiftiHeader(const FileSpec& spec);  // 352 bytes
FileBytes NrrdHeader(const FileSpec& spec, const std::string& encoding,
                     const std::string& data_file = "");  // with the empty line if attached
FileBytes MetaHeader(const FileSpec& spec, const std::string& data_file, std::int64_t compressed_bytes = 0);  // 0: not compressed

// One TIFF page a slice, through libtiff, which takes samples in this machine's byte order.
struct TiffOptions {
  int compression = 1;           // a number of tiff.h
  int tile = 0;                  // pixels a side; 0: strips
  float y_resolution = 0;        // 0: no resolution, else that of x is 100
  std::string description = {};  // the description of the first page
};
void WriteTiff(const std::string& path, const FileSpec& spec, const FileBytes& samples, const TiffOptions& options = {});

// The folder of real volumes that SLABSTREAM_SHARED_VOLUMES names; empty: it names none.
std::string SharedVolumes();

// Does what may happen to a byte of a file: another value, or one bit of it.
void Damage(char& byte, Random& random);

// The values of all voxels.
std::vector<double> DataValues(const Volume& volume);
// The data values in a box of such a volume.
std::vector<double> DataValues(const VolumeDescription& description, const VoxelBlock& block);

}  // namespace slabstream
