// Each row of bricks is filled by one task with its cells in ascending order, so that the last cell to claim a voxel is the one with the
// highest number, whichever threads there are.
//
// f_i   six times the volume of the tetrahedron of a voxel's centre and the face that lies opposite point i: above 0 on the point's side.
//       Divided by that of the whole cell it is the weight of the point's value (barycentric coordinates; Moebius 1827).

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "common/mesh/cell_runs.h"
#include "common/mesh/lattice.h"
#include "common/parallel/parallel.h"

namespace slabstream {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

class SolidCell {
 public:
  // Nothing: the cell is flat.
  static std::optional<SolidCell> Of(const Mesh& mesh, std::size_t cell, const CellBounds& bounds);

  // Writes the cell's values to row[x] of those x in [begin, end) whose centres (x, y, z) it contains. They lie in the cell's bounds.
  void FillRow(std::int32_t begin, std::int32_t end, double y, double z, float* row) const;

 private:
  struct Face {
    Vec3 normal, through;  // f_i = normal * (centre - through)
    double weight = 0;     // of point i: per f_i
  };

  double ValueAt(const std::array<double, 4>& f) const {
    double value = first_;
    for (std::size_t i = 1; i < 4; ++i) value += f[i] * faces_[i].weight * beyond_first_[i];
    return std::clamp(value, low_, high_);
  }

  std::array<Face, 4> faces_;
  // More than the rounding error of f_i: a centre on a face belongs to the cells on both sides, so there are no gaps between them.
  double tolerance_ = 0;
  double first_ = 0, low_ = 0, high_ = 0;
  std::array<double, 4> beyond_first_ = {};  // values less that of the first point
};

std::optional<SolidCell> SolidCell::Of(const Mesh& mesh, std::size_t cell, const CellBounds& bounds) {
  const Tetrahedron& t = mesh.tetrahedra[cell];
  std::array<Vec3, 4> places;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector3<float>& point = mesh.points[t[i]];
    places[i] = {double(point.x), double(point.y), double(point.z)};
  }
  SolidCell solid;
  // Differences of places in the cell are at most the sides of its bounds. f_i has six products of three of them, and seven roundings
  // by 2^-53 act on each (Higham 2002, "Accuracy and Stability of Numerical Algorithms", lemma 3.1): 4.7e-15 of the bounds' volume.
  solid.tolerance_ = 1e-14 * (double(bounds.high.x) - double(bounds.low.x)) * (double(bounds.high.y) - double(bounds.low.y)) *
                     (double(bounds.high.z) - double(bounds.low.z));
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 &a = places[(i + 1) % 4], &b = places[(i + 2) % 4], &c = places[(i + 3) % 4];
    Vec3 normal = Cross(b - a, c - a);
    const double whole = Dot(normal, places[i] - a);
    if (!(std::abs(whole) > solid.tolerance_)) return std::nullopt;
    if (whole < 0) normal = -normal;
    solid.faces_[i] = {normal, a, 1 / std::abs(whole)};
  }
  const ValueRange values = ValuesIn(mesh, cell);
  if (values.min > values.max) {
    solid.first_ = double{kNothing};
    return solid;
  }
  solid.low_ = double(values.min);
  solid.high_ = double(values.max);
  solid.first_ = double(mesh.values[mesh.at == ValuesAt::kCells ? cell : t[0]]);
  if (mesh.at == ValuesAt::kPoints) {
    for (std::size_t i = 1; i < 4; ++i) solid.beyond_first_[i] = double(mesh.values[t[i]]) - solid.first_;
  }
  return solid;
}

void SolidCell::FillRow(std::int32_t begin, std::int32_t end, double y, double z, float* row) const {
  std::array<double, 4> at_row;  // what y and z add to f_i
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& [normal, through, weight] = faces_[i];
    at_row[i] = normal.y * (y - through.y) + normal.z * (z - through.z);
  }
  constexpr std::int32_t kShort = 6;  // voxels: each is tried sooner than the ends of the row in the cell are found
  if (end - begin > kShort) {
    double low = begin, high = end - 1;
    for (std::size_t i = 0; i < 4; ++i) {
      const double slope = faces_[i].normal.x;
      if (std::abs(slope) <= tolerance_) continue;
      // Two voxels more than the quotient says: one for the tolerance and less than one for rounding, which moves f_i by less than that.
      const double crossing = faces_[i].through.x - at_row[i] / slope;
      if (slope > 0) {
        low = std::max(low, crossing - 2);
      } else {
        high = std::min(high, crossing + 2);
      }
    }
    if (!(low <= high)) return;
    begin = std::int32_t(low);
    end = std::int32_t(high) + 1;
  }
  for (std::int32_t x = begin; x < end; ++x) {
    std::array<double, 4> f;
    for (std::size_t i = 0; i < 4; ++i) f[i] = faces_[i].normal.x * (x - faces_[i].through.x) + at_row[i];
    if (std::min(std::min(f[0], f[1]), std::min(f[2], f[3])) >= -tolerance_) row[x] = float(ValueAt(f));
  }
}

void FillCell(const Mesh& mesh, std::size_t cell, const CellBounds& bounds, const Box& limit, VoxelBlock& block) {
  Box centres = limit;  // that lie in the bounds
  for (int axis = 0; axis < 3; ++axis) {
    centres.begin[axis] = std::int32_t(std::clamp(std::ceil(bounds.low[axis]), float(limit.begin[axis]), float(limit.end[axis])));
    centres.end[axis] = std::int32_t(std::clamp(std::floor(bounds.high[axis]) + 1, float(limit.begin[axis]), float(limit.end[axis])));
  }
  if (centres.empty()) return;
  const std::optional<SolidCell> solid = SolidCell::Of(mesh, cell, bounds);
  if (!solid) return;
  for (std::int32_t z = centres.begin.z; z < centres.end.z; ++z) {
    for (std::int32_t y = centres.begin.y; y < centres.end.y; ++y) {
      solid->FillRow(centres.begin.x, centres.end.x, y, z, block.samples<float>() + block.Offset({0, y, z}));
    }
  }
}

}  // namespace

Volume EmptyLattice(const VolumeGeometry& lattice) {
  Volume volume;
  volume.description = {lattice, ScalarType::kFloat32, {}};
  volume.block = MakeVoxelBlock(lattice.bounds(), ScalarType::kFloat32);
  const Index3& size = lattice.size;
  ParallelFor(0, size.z, [&](std::int32_t z) {
    std::fill_n(volume.block.samples<float>() + volume.block.Offset({0, 0, z}), std::size_t(size.x) * std::size_t(size.y), kNothing);
  });
  return volume;
}

void FillLattice(const Mesh& mesh, const CellRuns& runs, Volume& volume) {
  const Box& bounds = volume.block.box;
  const Index3 size = bounds.end, bricks = CubesOver(size, kBrick);
  ParallelFor(0, bricks.y * bricks.z, [&](std::int32_t row) {
    const Index3 begin = kBrick * Index3{0, row % bricks.y, row / bricks.y};
    const Box box = Intersection({begin, {size.x, begin.y + kBrick, begin.z + kBrick}}, bounds);
    runs.Visit(mesh, SpaceOf(box), [&](std::size_t cell, const CellBounds& of_cell) { FillCell(mesh, cell, of_cell, box, volume.block); });
  });
}

Volume Resample(const Mesh& mesh, const VolumeGeometry& lattice) {
  Volume volume = EmptyLattice(lattice);
  FillLattice(mesh, CellRuns(mesh), volume);
  return volume;
}

}  // namespace slabstream
