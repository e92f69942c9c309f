#include "worker/renderers/raycast/field_cells.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "common/parallel/parallel.h"

namespace slabstream {
namespace {

// Positions in cells of the field.
struct Span {
  Vec3 low, high;
  friend Span operator+(const Span& a, const Span& b) { return {a.low + b.low, a.high + b.high}; }
};

// What the map makes of the positions from `begin` to `end` along an axis. A cell becomes the sum of three, one of each axis, and an
// offset.
Span MappedSide(double begin, double end, const AffineMap& map, Axis axis) {
  Vec3 low, high;
  low[axis] = begin;
  high[axis] = end;
  const auto [least, most] = map.Bounds(low, high);
  return {1.0 / kCellSide * (least - map.offset), 1.0 / kCellSide * (most - map.offset)};
}

// The field's cells in a span, as far as there are some.
Box CellsIn(const Span& span, const Index3& counts) {
  Box cells;
  for (const Axis axis : kAxes) {
    const auto floor = [&](double position) { return std::int32_t(std::clamp(position + 1, 0.0, double(counts[axis]) + 1)) - 1; };
    cells.begin[axis] = std::max(floor(span.low[axis]), 0);
    cells.end[axis] = std::min(floor(span.high[axis]) + 1, counts[axis]);
  }
  return cells;
}

Box HullOfVisible(const Index3& counts, const std::vector<std::uint8_t>& visible) {
  Box hull;
  std::size_t number = 0;
  for (Index3 cell; cell.z < counts.z; ++cell.z) {
    for (cell.y = 0; cell.y < counts.y; ++cell.y, number += std::size_t(counts.x)) {
      const auto row = visible.begin() + std::ptrdiff_t(number), end = row + counts.x;
      const auto first = std::find(row, end, 0);
      if (first == end) continue;
      const auto last = std::find(std::reverse_iterator(end), std::reverse_iterator(row), 0).base();
      hull = Hull(hull, {{std::int32_t(first - row), cell.y, cell.z}, {std::int32_t(last - row), cell.y + 1, cell.z + 1}});
    }
  }
  return hull;
}

}  // namespace

std::vector<std::uint8_t> CellsThatShow(const RayPiece& piece, const RayPiece& field, const AffineMap& map,
                                        const std::vector<std::uint8_t>& visible) {
  const Index3 &counts = piece.cells.counts, &field_counts = field.cells.counts;
  std::vector<std::uint8_t> shown(CountIn(counts));
  if (map.is_identity() && field.voxels.box == piece.voxels.box) {
    std::ranges::transform(visible, shown.begin(), [](std::uint8_t of) { return of == 0 ? 1 : 0; });
    return shown;
  }
  const Box hull = HullOfVisible(field_counts, visible);
  const auto any_in = [&](const Box& cells) {
    if (cells.empty()) return false;
    for (std::int32_t z = cells.begin.z; z < cells.end.z; ++z) {
      for (std::int32_t y = cells.begin.y; y < cells.end.y; ++y) {
        const std::uint8_t* const row = &visible[NumberIn(field_counts, {0, y, z})];
        if (std::find(row + cells.begin.x, row + cells.end.x, 0) != row + cells.end.x) return true;
      }
    }
    return false;
  };
  constexpr double kRounding = 1.0 / 64 / kCellSide;
  const Vec3 rounding = {kRounding, kRounding, kRounding};
  const Vec3 first = 1.0 / kCellSide * (map.offset - ToVec3(field.voxels.box.begin - Uniform(1)));
  std::array<std::vector<Span>, 3> sides;  // of cells, by axis
  const auto begin_of = [&](Axis axis, std::int32_t cell) { return double(piece.voxels.box.begin[axis] - 1 + kCellSide * cell); };
  for (const Axis axis : kAxes) {
    for (std::int32_t i = 0; i < counts[axis]; ++i) {
      sides.at(std::size_t(Number(axis))).push_back(MappedSide(begin_of(axis, i), begin_of(axis, i + 1), map, axis));
    }
  }
  const Span whole_row = MappedSide(begin_of(Axis::kX, 0), begin_of(Axis::kX, counts.x), map, Axis::kX);
  ParallelFor(0, counts.z, [&](std::int32_t z) {
    for (std::int32_t y = 0; y < counts.y; ++y) {
      const Span row = Span{first - rounding, first + rounding} + sides[1][std::size_t(y)] + sides[2][std::size_t(z)];
      if (Intersection(CellsIn(row + whole_row, field_counts), hull).empty()) continue;
      std::uint8_t* const to = &shown[NumberIn(counts, {0, y, z})];
      for (std::size_t x = 0; x < std::size_t(counts.x); ++x) {
        if (any_in(Intersection(CellsIn(row + sides[0][x], field_counts), hull))) to[x] = 1;
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
