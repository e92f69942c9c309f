// SurfaceMaker: the isosurface of a volume, block by block, by marching cubes in the manner of flying edges (Schroeder, Maynard and Geveci,
// 2015): first all rows of a block count what they will make, then each knows where its vertices and triangles go, and all make them at the
// same time. Surface nets (Gibson, 1998) make better triangles, but four of them may meet in an edge; here always two do.
//
//   inside     a voxel whose value is at least the isovalue; one without a value (NaN) is outside
//   vertex     one for each edge between a voxel inside and one outside, where the value is interpolated linearly; at least
//              kLeastDistance from both, so that no two vertices coincide. Half-way if a value is not finite
//   normal     of unit length, towards lower values: the interpolated gradient of central differences
//   triangle   counterclockwise for who looks from lower values
//
// The surface has no holes: two triangles meet in each edge, in opposite directions, except where the surface leaves the volume. With
// `caps` it is closed there, on the border of the volume, half a voxel beyond the outermost voxels.
//
// A block keeps for the next ones the number of the first vertex of each of its rows along three of its sides. So blocks share vertices,
// and nothing else of a block is kept.
//
// Several makers may share a surface: each makes some slices of it, cut into the same columns. A maker that begins inside the volume counts
// the vertices that the one before it has in its last slice (Follow), and names them by their number among these.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "common/base/status.h"
#include "common/volume/volume.h"

namespace slabstream {

struct SurfaceVertex {
  std::array<float, 3> position, normal;  // in the world
  friend bool operator==(const SurfaceVertex&, const SurfaceVertex&) = default;
};
using SurfaceTriangle = std::array<std::int32_t, 3>;  // numbers of vertices

inline constexpr std::int64_t kMaxSurfaceVertices = INT32_MAX;  // most readers of PLY take signed numbers of 32 bits
inline constexpr double kLeastDistance = 1.0 / 1024;            // voxels
inline constexpr std::int32_t kOthersVertex = INT32_MIN;        // plus its number among LastSlice(): a vertex of the maker before this one
inline constexpr std::int32_t kSurfaceReach = 2;                // voxels before and behind a block that it depends on, at most

Status TooManyVertices();  // ResourceExhausted, for users

struct SurfacePart {
  std::vector<SurfaceVertex> vertices;  // numbered behind those of all earlier blocks
  std::vector<SurfaceTriangle> triangles;
};

class SurfaceMaker {
 public:
  SurfaceMaker(const VolumeDescription& level, double isovalue, bool caps);

  // What blocks must tile: the voxels of the level, with caps one more on each side.
  const Box& domain() const { return domain_; }
  // The surface in the cells whose last corners lie in `block`. Blocks before it along x, y and z come earlier. `samples` holds the voxels
  // of the level that `block`, grown by kSurfaceReach, has. The loops of this thread's arena share the work, and the result does not depend
  // on them. ResourceExhausted: more than kMaxSurfaceVertices.
  Result<SurfacePart> Add(const VoxelBlock& samples, const Box& block);

  // Of a maker that begins inside the volume, in each column before its first block: `slice` is what the column has of the slice before it,
  // and `samples` are as those of Add. Columns come in order of y, then of x.
  void Follow(const VoxelBlock& samples, const Box& slice);
  // What the maker behind this one counts, once all blocks were added: numbers of the vertices on the edges along x and y of the last
  // slice.
  std::vector<std::int32_t> LastSlice() const;

 private:
  template <class T>
  class Block;
  // Numbers of the first vertices on the edges of a row of voxels that lead back along x, y and z, and the number behind its last one.
  struct Row {
    std::int64_t x = 0, y = 0, z = 0, end = 0;
  };
  using Rows = std::vector<Row>;
  // The rows before the block along y and z, then its own: those whose numbers are not known yet are empty.
  struct Sides {
    Rows rows, before_x;
  };
  template <class T>
  Sides TakeSides(const Block<T>& work, const Box& block);
  // For the blocks behind it.
  template <class T>
  void KeepSides(const Block<T>& work, const Box& block, Rows rows);

  const VolumeGeometry geometry_;
  const Box bounds_, domain_;
  const double isovalue_;  // as samples are stored
  const bool falls_;       // values fall where stored samples rise
  std::int64_t vertices_ = 0, others_vertices_ = 0;
  // Rows of earlier blocks, by the beginning of the block that needs them: those before it along an axis.
  std::map<Index3, Rows> before_x_, before_y_, before_z_;
};

}  // namespace slabstream
