#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <new>
#include <span>
#include <string>
#include <vector>

#include "common/base/files.h"
#include "common/volume_io/text_header.h"
#include "common/volume_io/volume_reader.h"

namespace slabstream {
namespace {

// Samples for a file without a value mapping: the data values themselves.
struct FileSamples {
  const char* nrrd_type = "uint8";
  const char* meta_type = "MET_UCHAR";
  AlignedVector<std::byte> converted;  // empty: the volume's own bytes
};

template <class Stored, class Value>
AlignedVector<std::byte> DataValues(const Volume& volume) {
  const std::int64_t count = volume.block.box.voxel_count();
  AlignedVector<std::byte> bytes(std::size_t(count) * sizeof(Value));
  const Stored* in = volume.block.samples<Stored>();
  Value* out = reinterpret_cast<Value*>(bytes.data());
  for (std::int64_t i = 0; i < count; ++i) out[i] = Value(volume.description.mapping.FromStored(double(in[i])));
  return bytes;
}

FileSamples ToFileSamples(const Volume& volume) {
  const ValueMapping& mapping = volume.description.mapping;
  const ScalarType type = volume.description.type;
  if (mapping == ValueMapping{}) {
    switch (type) {
      case ScalarType::kUint8: return {"uint8", "MET_UCHAR", {}};
      case ScalarType::kUint16: return {"uint16", "MET_USHORT", {}};
      case ScalarType::kFloat32: return {"float", "MET_FLOAT", {}};
    }
  }
  // Samples read from signed integers become signed again.
  if (type == ScalarType::kUint8 && mapping == ValueMapping{1, -128}) {
    return {"int8", "MET_CHAR", DataValues<std::uint8_t, std::int8_t>(volume)};
  }
  if (type == ScalarType::kUint16 && mapping == ValueMapping{1, -32768}) {
    return {"int16", "MET_SHORT", DataValues<std::uint16_t, std::int16_t>(volume)};
  }
  return VisitScalarType(type, [&]<class T>(const T*) { return FileSamples{"float", "MET_FLOAT", DataValues<T, float>(volume)}; });
}

std::string Numbers(const Vec3& v, const char* separator) { return fmt::format("{}{}{}{}{}", v.x, separator, v.y, separator, v.z); }

// The header's lines about the spacing and, if it is known, the orientation.
std::string NrrdSpace(const VolumeGeometry& geometry) {
  const Orientation& orientation = geometry.orientation;
  if (orientation.world == World::kVoxels) return fmt::format("spacings: {}\n", Numbers(geometry.spacing, " "));
  const auto step = [&](int i) { return Numbers(geometry.spacing[i] * orientation.axes[std::size_t(i)], ","); };
  return fmt::format("space: {}\nspace directions: ({}) ({}) ({})\nspace origin: ({})\n",
                     orientation.world == World::kPatient ? "right-anterior-superior" : "3D-right-handed", step(0), step(1), step(2),
                     Numbers(orientation.origin, ","));
}

std::string NrrdHeader(const VolumeGeometry& geometry, const char* type) {
  return fmt::format("NRRD0004\ntype: {}\ndimension: 3\n{}sizes: {} {} {}\nkinds: domain domain domain\nendian: little\nencoding: gzip\n\n",
                     type, NrrdSpace(geometry), geometry.size.x, geometry.size.y, geometry.size.z);
}

// A patient's space is left, posterior, superior in MetaImage. Its letters say where each axis begins: left, posterior, inferior, since
// axes lie near those of World.
std::string MetaSpace(const VolumeGeometry& geometry) {
  const Orientation& orientation = geometry.orientation;
  if (orientation.world == World::kVoxels) return "";
  const bool patient = orientation.world == World::kPatient;
  const Vec3 signs = patient ? kRasFromLps : Vec3{1, 1, 1};
  const auto axis = [&](std::size_t i) { return Numbers(signs * orientation.axes[i], " "); };
  return fmt::format("TransformMatrix = {} {} {}\nOffset = {}\n{}", axis(0), axis(1), axis(2), Numbers(signs * orientation.origin, " "),
                     patient ? "AnatomicalOrientation = LPI\n" : "");
}

std::string MetaHeader(const VolumeGeometry& geometry, const char* type, const std::string& data_file) {
  const Index3& size = geometry.size;
  return fmt::format(
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
      "{}ElementSpacing = {}\nDimSize = {} {} {}\nElementType = {}\nElementDataFile = {}\n",
      MetaSpace(geometry), Numbers(geometry.spacing, " "), size.x, size.y, size.z, type, data_file);
}

// Appends the bytes as one gzip member.
void AppendGzip(OutputFile& file, std::span<const std::byte> bytes) {
  constexpr int kGzipWindow = 15 + 16;
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzipWindow, 8, Z_DEFAULT_STRATEGY) != Z_OK) throw std::bad_alloc();
  std::vector<std::byte> out(kBlock);
  for (int code = Z_OK; code != Z_STREAM_END && file.ok();) {
    if (stream.avail_in == 0) {
      const std::size_t taken = std::min(bytes.size(), kBlock);  // zlib counts in 32 bits
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
      stream.avail_in = uInt(taken);
      bytes = bytes.subspan(taken);
    }
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = uInt(out.size());
    code = deflate(&stream, bytes.empty() ? Z_FINISH : Z_NO_FLUSH);
    file.Append(std::span(out).first(out.size() - stream.avail_out));
  }
  deflateEnd(&stream);
}

}  // namespace

Status WriteVolume(const Volume& volume, const std::string& path) {
  const std::string lower = ToLower(path);
  const bool nrrd = lower.ends_with(".nrrd"), detached = lower.ends_with(".mhd");
  if (!nrrd && !detached && !lower.ends_with(".mha")) {
    return Status::InvalidArgument(path + ": volumes are written as .nrrd, .mha or .mhd");
  }
  Result<OutputFile> file = OutputFile::Create(path);
  if (!file.ok()) return file.status();
  const FileSamples samples = ToFileSamples(volume);
  const std::span<const std::byte> bytes = samples.converted.empty() ? std::span(volume.block.bytes) : std::span(samples.converted);
  const VolumeGeometry& geometry = volume.description.geometry;
  if (nrrd) {
    file->Append(NrrdHeader(geometry, samples.nrrd_type));
    AppendGzip(*file, bytes);
    return file->Finish();
  }
  if (!detached) {
    file->Append(MetaHeader(geometry, samples.meta_type, "LOCAL"));
    file->Append(bytes);
    return file->Finish();
  }
  const std::filesystem::path data_path = std::filesystem::path(path).replace_extension(".raw");
  Result<OutputFile> data = OutputFile::Create(data_path.string());
  if (!data.ok()) return data.status();
  data->Append(bytes);
  file->Append(MetaHeader(geometry, samples.meta_type, data_path.filename().string()));
  // Store both files before either takes its place.
  if (Status status = file->Close(); !status.ok()) return status;
  if (Status status = data->Finish(); !status.ok()) return status;
  return file->Finish();
}

}  // namespace slabstream
