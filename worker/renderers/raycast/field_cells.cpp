#include "worker/renderers/raycast/field_cells.h"

#include <algorithm>
#include <cmath>

#include "common/parallel/parallel.h"
#include "worker/rays/field_map.h"

namespace slabstream {

std::vector<std::uint8_t> CellsThatShow(const RayPiece& piece, const RayPiece& field, const AffineMap& map,
                                        const std::vector<std::uint8_t>& visible) {
  constexpr double kRounding = 1.0 / 64;  // voxels
  const Index3 &counts = piece.cells.counts, &field_counts = field.cells.counts;
  std::vector<std::uint8_t> shown(CountIn(counts));
  const auto any_in = [&](const Index3& begin, const Index3& end) {
    for (Index3 cell = begin; cell.z < end.z; ++cell.z) {
      for (cell.y = begin.y; cell.y < end.y; ++cell.y) {
        const std::uint8_t* const row = &visible[NumberIn(field_counts, {0, cell.y, cell.z})];
        if (std::any_of(row + begin.x, row + end.x, [](std::uint8_t of) { return of == 0; })) return true;
      }
    }
    return false;
  };
  const bool same_cells = map.is_identity() && field.voxels.box.begin == piece.voxels.box.begin;
  const Vec3 origin = ToVec3(piece.voxels.box.begin) - Vec3{1, 1, 1}, field_origin = ToVec3(field.voxels.box.begin) - Vec3{1, 1, 1};
  ParallelFor(0, counts.z, [&](std::int32_t z) {
    for (Index3 cell = {0, 0, z}; cell.y < counts.y; ++cell.y) {
      for (cell.x = 0; cell.x < counts.x; ++cell.x) {
        Index3 begin = cell, end = cell + Uniform(1);
        if (!same_cells) {
          const SampledRegion span = Mapped({origin + double(kCellSide) * ToVec3(cell), origin + double(kCellSide) * ToVec3(end)}, map);
          for (const Axis axis : kAxes) {
            const auto of = [&](double position) {
              const double number = std::floor((position - field_origin[axis]) / kCellSide);
              return std::int32_t(std::clamp(number, -1.0, double(field_counts[axis])));
            };
            begin[axis] = std::max(of(span.low[axis] - kRounding), 0);
            end[axis] = of(span.high[axis] + kRounding) + 1;
          }
        }
        for (const Axis axis : kAxes) end[axis] = std::min(end[axis], field_counts[axis]);
        const bool empty = begin.x >= end.x || begin.y >= end.y || begin.z >= end.z;
        if (!empty && any_in(begin, end)) shown[NumberIn(counts, cell)] = 1;
      }
    }
  });
  return shown;
}

void SpreadToNeighbours(const Index3& counts, std::vector<std::uint8_t>& visible) {
  std::size_t stride = 1;
  for (const Axis axis : kAxes) {
    const std::vector<std::uint8_t> before = visible;
    const std::size_t end = stride * std::size_t(counts[axis]);
    for (std::size_t i = 0; i < visible.size(); ++i) {
      const std::size_t along = i % end;
      if (along >= stride) visible[i] = std::min(visible[i], before[i - stride]);
      if (along + stride < end) visible[i] = std::min(visible[i], before[i + stride]);
    }
    stride = end;
  }
}

}  // namespace slabstream
