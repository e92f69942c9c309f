// What a reader of one format makes of a file: a description of the volume, and the samples in the type that the file has.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/base/status.h"
#include "common/memory/aligned_buffer.h"
#include "common/mesh/mesh.h"
#include "common/volume/field_info.h"
#include "common/volume/volume.h"
#include "data/volume_io/payload.h"
#include "data/volume_io/read_options.h"
#include "data/volume_io/sample_type.h"
#include "data/volume_io/uneven_axis.h"

namespace slabstream {

class GridCells;  // common/mesh/mesh_part.h

inline constexpr int kMaxComponents = 1024;  // components of a voxel

struct RawHeader {
  Index3 size;
  // Samples of one voxel, which lie together; above 1 only where options.channel takes one of them.
  int components = 1;  // in [1, kMaxComponents]
  // Volumes, at most kMaxVolumes, one after the other in the payload; of an image with channels: of each channel, one behind the other.
  TimeAxis times = TimeAxis();
  std::int64_t number = 0;  // the volume's number in [0, times.count)
  World world = World::kVoxels;
  // From a voxel to the next one along its x, y and z, in that world. kVoxels: each along one axis, in some order. As in the file: may be
  // zero or NaN (kVoxels: only in that order).
  std::array<Vec3, 3> steps = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
  Vec3 origin;             // the centre of the first voxel
  UnevenAxes uneven = {};  // of a rectilinear grid: where the voxels lie along x, y and z of the file, which are those of the world
  std::optional<LengthUnit> unit{};  // the unit of steps and origin, if the file states it
  std::string_view matrix{};         // the file's name for the steps, for messages; lives as long as the program
  SampleType type = SampleType::kUint8;
  ValueMapping rescale;  // from the file's samples to data values
  bool labels = false;   // samples are numbers of structures, not measurements
  // An image's channels, and which of them this is; empty: there is one, of which the file says nothing.
  std::vector<FieldInfo> channels = {};
  int channel = 0;
  std::vector<std::string> notes = {};  // a sentence each of what the reader chose where the file leaves it open: SourceInfo

  // Bytes of all components of a volume.
  std::int64_t sample_bytes() const {
    return VolumeGeometry{size}.bounds().voxel_count() * std::int64_t(BytesPerSample(type)) * components;
  }
  // Bytes of all volumes, or more than any file has.
  std::int64_t all_bytes() const {
    constexpr std::int64_t kMost = std::int64_t{1} << 61;
    const std::int64_t count = times.count * std::max<std::int64_t>(1, std::int64_t(channels.size()));
    return count > kMost / sample_bytes() ? kMost : count * sample_bytes();
  }
};

struct PackedSamples;

// What a header says: the volume, and where its samples lie.
struct LocatedSamples {
  RawHeader header;
  Payload payload;  // the samples of all volumes
  // Where they lie if that is not how they are stored; then the payload does not matter.
  std::shared_ptr<const PackedSamples> packed = {};
};

struct RawVolume {
  RawHeader header;
  AlignedVector<std::byte> bytes;  // this machine's byte order; none if only headers were read
  // The cells of an unstructured grid, in data space of the volume, which is not turned or straightened.
  std::shared_ptr<const Mesh> cells;
  std::shared_ptr<const GridCells> stored_cells = nullptr;  // instead, those of a grid that does not fit the memory
  bool size_unknown = false;                                // headers alone do not tell it
  std::vector<std::filesystem::path> other_files;           // beside the path that is read, or the folder of many
};

// Steps along the axes themselves.
inline std::array<Vec3, 3> StepsOf(const Vec3& spacing) { return {Vec3{spacing.x, 0, 0}, Vec3{0, spacing.y, 0}, Vec3{0, 0, spacing.z}}; }

// From left, posterior, superior to right, anterior, superior, and back.
inline constexpr Vec3 kRasFromLps = {-1, -1, 1};

// Sets the size and the number of the volume by what a file says of its dimensions: two of a slice, three, or four with time; those of 1
// behind the third are left out. `channels`: of an image, each with all volumes behind the one before; options.channel takes one. Errors:
// there are fewer than two or more than four dimensions, one of three is no whole number in [1, kMaxVolumeSide], there are several
// volumes and options.time does not take one, there is no such channel, or voxels of channels have several components.
Status SetSize(RawHeader& header, const std::string& path, std::vector<double> sizes, const ReadOptions& options, double channels = 1);
// Which of `count` volumes options.time takes; the first one if options.describe. InvalidArgument: none, although there are several, or one
// that there is not.
Result<std::int64_t> ChosenVolume(const std::string& path, std::int64_t count, const ReadOptions& options);

// InvalidArgument, naming `path`: of several components a voxel options.channel takes none, or one that there is not; or there is one, and
// no channel of an image was chosen by it.
Status CheckChannel(const std::string& path, const RawHeader& header, const ReadOptions& options);

// Takes memory for the samples, unless only headers are read. Errors of CheckChannel. ResourceExhausted: too large.
Result<RawVolume> TakeMemory(const std::string& path, const RawHeader& header, const ReadOptions& options);

// The payload of the chosen volume alone. DataLoss: the file is too short for it. NotFound: there is no such file. Messages begin with
// `path`.
Result<Payload> PayloadOfVolume(const std::string& path, const LocatedSamples& located);

// Checks that the file and the memory are large enough, then takes memory for the samples and reads them, unless only headers are read.
Result<RawVolume> ReadSamples(const std::string& path, const LocatedSamples& located, const ReadOptions& options);

// The component of a voxel that `channel` takes (ReadOptions::channel), or the luminance of the first three by ITU-R
// BT.709.
template <class T>
T TakenComponent(const T* voxel, std::optional<int> channel) {
  if (channel != kLuminance) return voxel[channel.value_or(0)];
  const double value = 0.2126 * double(voxel[0]) + 0.7152 * double(voxel[1]) + 0.0722 * double(voxel[2]);
  return std::is_integral_v<T> ? T(std::nearbyint(value)) : T(value);
}

// Keeps one of several components in place: the one that options.channel takes, or their luminance.
void TakeChannel(RawVolume& raw, const ReadOptions& options);

}  // namespace slabstream
