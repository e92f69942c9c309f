// ChunkedSource: a VolumeSource of arrays that are stored in chunks, one for each level. A format says which axes of the arrays are x, y
// and z, at which index of the others the volume lies, and where the voxels of each level are.
//
// A line of the log tells if all chunks of a level were asked for, and no chunk of the source was there.
//
// Samples are kept as in data/open/read_volume.h, but as their type alone says, since nobody has seen all values: int8 and int16 are
// shifted into the unsigned type; integers of more bits and float64 become float32.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/sources/chunked_array.h"
#include "data/sources/read_context.h"
#include "data/sources/volume_source.h"

namespace slabstream {

struct PyramidLevel {
  std::shared_ptr<ChunkedArray> array;
  // Axes of the array that are x, y and z; -1: it has no such axis, so the volume is one voxel thick there.
  std::array<int, 3> axes = {2, 1, 0};
  std::array<bool, 3> mirrored = {};      // the first voxel along x, y or z is the array's last element there
  std::vector<std::uint64_t> at;          // index along each axis of the array; along x, y and z it does not matter
  int time_axis = -1, channel_axis = -1;  // along which `at` says the time and the channel; -1: there is no such axis
  Vec3 spacing = {1, 1, 1};               // > 0, finite
  Vec3 origin;                            // in the world, of the centre of the level's first voxel
};

struct Pyramid {
  std::vector<PyramidLevel> levels;  // finest first
  Orientation orientation = {};      // the orientation of all levels; its origin does not matter, since each level has its own
  ValueMapping rescale = {};         // from stored values to data values
  SourceInfo info = {};              // without its levels and exact; file_type: "" means that of the arrays
};

// InvalidArgument, naming `name`: no level; one whose sides are out of [1, kMaxVolumeSide], or that has too many chunks of a few bytes;
// levels of different types; a spacing that is not above 0 and finite.
Result<std::shared_ptr<VolumeSource>> MakeChunkedSource(const std::string& name, Pyramid pyramid, const SourceContext& context);

}  // namespace slabstream
