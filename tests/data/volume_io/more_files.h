// Files of further formats, byte by byte like those of volume_files.h; pictures through their libraries.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "tests/data/volume_io/volume_files.h"

namespace slabstream {

FileBytes Base64(const FileBytes& bytes);

struct MrcSpec {
  Index3 size = {4, 3, 2};
  int mode = 0;
  bool big_endian = false;
  Index3 starts, axes = {1, 2, 3};
  Vec3 spacing = {1, 1, 1}, angles = {90, 90, 90}, origin;
  int volumes = 1;        // more: a stack of volumes
  int extension = 0;      // bytes
  std::int32_t imod = 0;  // flags of IMOD; with its stamp unless 0
};
FileBytes MrcHeader(const MrcSpec& spec);  // with the extension

// `fields`: spacing, x_ras, y_ras, z_ras and c_ras; `good`: ras_good_flag.
FileBytes MghHeader(const Index3& size, std::int32_t type, const std::array<float, 15>& fields, bool good = true);

// `shape`: as Python writes it, "(2, 3, 4)".
FileBytes NpyHeader(const std::string& descr, const std::string& shape, bool fortran = false, int version = 1);
FileBytes NpyHeader(const FileSpec& spec);

// `samples`: of EncodeSamples, in spec's byte order (binary: big endian), or numbers as text.
FileBytes VtkFile(const FileSpec& spec, const FileBytes& samples, bool binary, const std::string& components = "");
std::string AsText(const std::vector<double>& values);

struct VtiOptions {
  std::string format = "appended";  // ascii, binary or appended
  std::string encoding = "raw";     // how appended samples are written: raw or base64
  bool wide_header = false;         // UInt64
  std::size_t block = 0;            // bytes of a block; 0: not compressed
  std::string compressor = "ZLib";  // or LZ4 or LZMA
  std::string direction;            // nine numbers
  std::string extent;               // "0 3 0 2 0 1" by the size
  Vec3 origin;
  std::string attributes = "Scalars=\"density\"";  // the attributes of PointData
  int arrays = 1;                                  // the same samples under the names density, density2, ...
  int components = 1;
};
// Samples as they stand in an XML file of VTK: with header and blocks, encoded or not. `samples`: of EncodeSamples in the spec's byte
// order; ascii: as text.
FileBytes VtkXmlSamples(const FileSpec& spec, const FileBytes& samples, const VtiOptions& options);
// The same samples.
FileBytes VtiFile(const FileSpec& spec, const FileBytes& samples, const VtiOptions& options = {});

// Samples in this machine's byte order; 8 or 16 bits. `kind`: the PNG colour type, 0 grey, 2 RGB, 3 palette, 4 grey with alpha, 6 RGBA.
void WritePng(const std::string& path, const Index3& size, int bits, int kind, const FileBytes& samples, bool interlaced = false);
struct BmpKind {
  int bits = 8, compression = 0;
  FileBytes palette = {};  // blue, green, red and 0 of each colour
  bool from_top = false;   // rows, else from the bottom
};
// `rows`: as they are in the file, each filled up to four bytes.
FileBytes Bmp(const Index3& size, const BmpKind& kind, const FileBytes& rows);
// Lossless; in a JP2 file if the path ends so, else the bare code stream. `samples`: the components of each pixel together.
void WriteJpeg2000(const std::string& path, const Index3& size, int components, int bits, bool is_signed, const std::vector<int>& samples);
void WriteJpeg(const std::string& path, const Index3& size, int components, const FileBytes& samples, bool progressive = false);

// A file of every format that is one file, with the same samples: int16 where the format has it.
struct SampleFile {
  std::string file;  // its name
  FileBytes bytes;
  std::size_t header = 0;  // bytes before the samples, or where they are compressed before the stream
};
std::vector<SampleFile> OneOfEachFormat();

// Compressed streams of three formats (v.nii.gz, v.nrrd, v.mha) for each of five types in both byte orders: integers in [0, 127] at random.
std::vector<SampleFile> CompressedStreams(const Index3& size, Random& random);

}  // namespace slabstream
