#include "tests/data/volume_io/volume_files.h"

#include <tiffio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <iterator>

#include "common/base/check.h"
#include "tests/data/codecs/packed_bytes.h"

namespace slabstream {
namespace {

template <class T>
void Put(FileBytes& bytes, T value, bool big_endian) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), &value, sizeof(T));
  if (big_endian) std::reverse(raw.begin(), raw.end());  // tests run on little-endian machines
  bytes.append(raw.data(), raw.size());
}

template <class T>
void PutAt(FileBytes& bytes, std::size_t offset, T value, bool big_endian) {
  FileBytes raw;
  Put(raw, value, big_endian);
  bytes.replace(offset, raw.size(), raw);
}

std::string Numbers(const Index3& v) { return std::to_string(v.x) + " " + std::to_string(v.y) + " " + std::to_string(v.z); }
std::string Numbers(const Vec3& v) { return std::to_string(v.x) + " " + std::to_string(v.y) + " " + std::to_string(v.z); }

}  // namespace

FileBytes Gzip(const FileBytes& bytes) { return PackBytes("gzip", bytes); }
FileBytes Zlib(const FileBytes& bytes) { return PackBytes("zlib", bytes); }

FileBytes EncodeSamples(SampleType type, const std::vector<double>& values, bool big_endian) {
  FileBytes bytes;
  for (const double value : values) {
    switch (type) {
      case SampleType::kInt8: Put(bytes, std::int8_t(value), big_endian); break;
      case SampleType::kUint8: Put(bytes, std::uint8_t(value), big_endian); break;
      case SampleType::kInt16: Put(bytes, std::int16_t(value), big_endian); break;
      case SampleType::kUint16: Put(bytes, std::uint16_t(value), big_endian); break;
      case SampleType::kInt32: Put(bytes, std::int32_t(value), big_endian); break;
      case SampleType::kUint32: Put(bytes, std::uint32_t(value), big_endian); break;
      case SampleType::kInt64: Put(bytes, std::int64_t(value), big_endian); break;
      case SampleType::kUint64: Put(bytes, std::uint64_t(value), big_endian); break;
      case SampleType::kFloat32: Put(bytes, float(value), big_endian); break;
      case SampleType::kFloat64: Put(bytes, value, big_endian); break;
      case SampleType::kFloat16: Put(bytes, Half(value).bits, big_endian); break;
    }
  }
  return bytes;
}

FileBytes NiftiHeader(const FileSpec& spec) {
  constexpr std::int16_t kTypes[] = {256, 2, 4, 512, 8, 768, 1024, 1280, 16, 64};  // by SampleType
  FileBytes bytes(352, '\0');
  const auto put = [&](std::size_t offset, auto value) { PutAt(bytes, offset, value, spec.big_endian); };
  put(0, std::int32_t{348});
  std::vector<std::int16_t> dimensions = spec.dimensions;
  if (dimensions.empty()) dimensions = {std::int16_t(spec.size.x), std::int16_t(spec.size.y), std::int16_t(spec.size.z)};
  put(40, std::int16_t(dimensions.size()));
  dimensions.resize(7, 1);
  for (std::size_t i = 0; i < 7; ++i) put(42 + 2 * i, dimensions[i]);
  put(70, kTypes[int(spec.type)]);
  put(72, std::int16_t(8 * BytesPerSample(spec.type)));
  put(76, spec.qfac);
  for (std::size_t i = 0; i < 7; ++i) put(80 + 4 * i, i < 3 ? float(spec.spacing[int(i)]) : 1.0F);
  put(108, 352.0F);
  put(112, spec.slope);
  put(116, spec.intercept);
  put(252, spec.qform);
  put(254, spec.sform);
  for (std::size_t i = 0; i < spec.quaternion.size(); ++i) put(256 + 4 * i, spec.quaternion[i]);
  for (std::size_t i = 0; i < spec.matrix.size(); ++i) put(280 + 4 * i, spec.matrix[i]);
  bytes.replace(344, 4, std::string("n+1\0", 4));
  return bytes;
}

FileBytes NrrdHeader(const FileSpec& spec, const std::string& encoding, const std::string& data_file) {
  constexpr const char* kTypes[] = {"int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float", "double"};
  std::string text = "NRRD0004\n# by a test\ntype: " + std::string(kTypes[int(spec.type)]) +
                     "\ndimension: 3\nsizes: " + Numbers(spec.size) + "\nspacings: " + Numbers(spec.spacing) +
                     "\nendian: " + (spec.big_endian ? "big" : "little") + "\nencoding: " + encoding + "\n";
  return text + (data_file.empty() ? "\n" : "data file: " + data_file + "\n");
}

FileBytes MetaHeader(const FileSpec& spec, const std::string& data_file, std::int64_t compressed_bytes) {
  constexpr const char* kTypes[] = {"MET_CHAR", "MET_UCHAR",     "MET_SHORT",      "MET_USHORT", "MET_INT",
                                    "MET_UINT", "MET_LONG_LONG", "MET_ULONG_LONG", "MET_FLOAT",  "MET_DOUBLE"};
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = " + std::string(spec.big_endian ? "True" : "False") +
         "\nCompressedData = " +
         (compressed_bytes > 0 ? "True\nCompressedDataSize = " + std::to_string(compressed_bytes) : std::string("False")) +
         "\nElementSpacing = " + Numbers(spec.spacing) + "\nDimSize = " + Numbers(spec.size) + "\nElementType = " + kTypes[int(spec.type)] +
         "\nElementDataFile = " + data_file + "\n";
}

void WriteTiff(const std::string& path, const FileSpec& spec, const FileBytes& samples, const TiffOptions& options) {
  TIFF* tiff = TIFFOpen(path.c_str(), spec.big_endian ? "wb" : "wl");
  CHECK(tiff != nullptr) << path;
  const std::size_t sample_bytes = BytesPerSample(spec.type), row_bytes = std::size_t(spec.size.x) * sample_bytes;
  const bool is_float = spec.type >= SampleType::kFloat32, is_signed = int(spec.type) % 2 == 0;
  // Samples of a row, filled up with zeros to `count` or where there is none.
  const auto row_of = [&](int x, int y, int z, int count) {
    FileBytes row;
    if (y < spec.size.y) {
      const std::size_t begin = (std::size_t(z) * std::size_t(spec.size.y) + std::size_t(y)) * row_bytes + std::size_t(x) * sample_bytes;
      row = samples.substr(begin, std::size_t(std::min(count, spec.size.x - x)) * sample_bytes);
    }
    row.resize(std::size_t(count) * sample_bytes);
    return row;
  };
  for (int z = 0; z < spec.size.z; ++z) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, spec.size.x);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, spec.size.y);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, int(8 * sample_bytes));
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, is_float ? SAMPLEFORMAT_IEEEFP : is_signed ? SAMPLEFORMAT_INT : SAMPLEFORMAT_UINT);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, options.compression);
    if (z == 0 && !options.description.empty()) TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, options.description.c_str());
    if (options.y_resolution > 0) {
      TIFFSetField(tiff, TIFFTAG_XRESOLUTION, 100.0);
      TIFFSetField(tiff, TIFFTAG_YRESOLUTION, double(options.y_resolution));
    }
    if (options.tile > 0) {
      TIFFSetField(tiff, TIFFTAG_TILEWIDTH, options.tile);
      TIFFSetField(tiff, TIFFTAG_TILELENGTH, options.tile);
      for (int y = 0; y < spec.size.y; y += options.tile) {
        for (int x = 0; x < spec.size.x; x += options.tile) {
          FileBytes tile;
          for (int row = 0; row < options.tile; ++row) tile += row_of(x, y + row, z, options.tile);
          CHECK_GT(TIFFWriteTile(tiff, tile.data(), std::uint32_t(x), std::uint32_t(y), 0, 0), 0);
        }
      }
    } else {
      TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 2);
      for (int y = 0; y < spec.size.y; ++y) CHECK_EQ(TIFFWriteScanline(tiff, row_of(0, y, z, spec.size.x).data(), std::uint32_t(y), 0), 1);
    }
    CHECK_EQ(TIFFWriteDirectory(tiff), 1);
  }
  TIFFClose(tiff);
}

std::string SharedVolumes() {
  const char* path = std::getenv("SLABSTREAM_SHARED_VOLUMES");
  return path != nullptr ? path : "";
}

void Damage(char& byte, Random& random) {
  byte = random.Chance(0.3) ? char(random.Integer(0, 255)) : char(byte ^ (1 << random.Integer(0, 7)));
}

std::vector<double> DataValues(const Volume& volume) {
  std::vector<double> values;
  VisitScalarType(volume.description.type, [&]<class T>(const T*) {
    for (std::int64_t i = 0; i < volume.block.box.voxel_count(); ++i) {
      values.push_back(volume.description.mapping.FromStored(double(volume.block.samples<T>()[i])));
    }
  });
  return values;
}

std::vector<double> DataValues(const VolumeDescription& description, const VoxelBlock& block) {
  return DataValues(Volume{.description = {.geometry = {block.box.size()}, .type = block.type, .mapping = description.mapping},
                           .block = {{{0, 0, 0}, block.box.size()}, block.type, block.bytes}});
}

}  // namespace slabstream
