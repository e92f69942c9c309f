// From the axes that a file stores its voxels in to those nearest to its world's. Voxels are turned (axes exchanged and run backwards),
// which moves samples and changes none. If the stored axes are not at right angles, as in CT with a tilted gantry, the voxels are
// straightened: sampled anew on a grid whose axes are, within slices: measurements by linear interpolation, labels by the nearest voxel.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "common/base/status.h"
#include "common/volume/volume.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {

// The axis i of the turned voxels is the stored axis from[i], run backwards if flipped[i].
struct AxisTurn {
  std::array<int, 3> from = {0, 1, 2};
  std::array<bool, 3> flipped{};
  friend bool operator==(const AxisTurn&, const AxisTurn&) = default;
};

// Axes that are not at right angles: x of a straight grid = x + x_per_y * y + x_per_z * z of the slanted one; y = y + y_per_z * z; z = z.
struct Slant {
  double x_per_y = 0, x_per_z = 0, y_per_z = 0;
  Vec3 first;  // where the straight grid's voxel 0, 0, 0 lies; whole numbers
};

struct WorldPlacement {
  AxisTurn turn;
  std::optional<Slant> slant;  // the slant of the turned voxels
  VolumeGeometry geometry;     // the geometry of the turned and straightened voxels
  UnevenAxes uneven = {};      // SourceInfo::uneven, of the turned voxels
};

// Steps whose angles differ from right ones by less than this (radians) are at right angles: files round their numbers.
inline constexpr double kStraight = 1e-4;

// The turn whose axes are nearest to the world's: of all right-handed ones, the one with the largest sum of cosines. So the same voxels in
// any order of storage give the same result. InvalidArgument, naming `path` and the header's matrix: a step or the origin is not finite, a
// step is zero, the steps lie in a plane, or the straight grid is larger than a volume can be.
Result<WorldPlacement> PlaceInWorld(const RawHeader& header, const std::string& path);

bool IsFinite(const Vec3& v);
std::string InBrackets(const Vec3& v);  // "(0, 1.5, nan)", for messages

enum class Sampling { kLinear, kNearest };
// `samples`: of a whole volume. `size`: of the slanted grid; `straight_size`: of the straight one. `outside`: what voxels of it hold that
// the slanted one does not reach, a sample.
AlignedVector<std::byte> StraightenVoxels(SampleType type, const AlignedVector<std::byte>& samples, const Index3& size, const Slant& slant,
                                          const Index3& straight_size, double outside, Sampling sampling);

}  // namespace slabstream
