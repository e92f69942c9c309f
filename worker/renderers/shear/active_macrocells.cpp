#include "worker/renderers/shear/active_macrocells.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/parallel/parallel.h"
#include "worker/renderers/brick_ranges.h"

namespace slabstream::shear {
namespace {

std::int32_t FloorDiv(std::int32_t a, std::int32_t b) { return a >= 0 ? a / b : -((b - 1 - a) / b); }

template <class T>
MacrocellRange RangeIn(const BrickView<T>& brick, const Box& box) {
  constexpr float kLargest = std::numeric_limits<float>::max();
  MacrocellRange range{kLargest, -kLargest};
  for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
    for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
      const T* const row = brick.Row(y, z) + (box.begin.x - brick.begin.x);
      for (std::int32_t x = 0; x < box.size().x; ++x) {
        const auto sample = float(row[x]);
        const bool finite = std::abs(sample) <= kLargest;
        range.min = finite && sample < range.min ? sample : range.min;
        range.max = finite && sample > range.max ? sample : range.max;
      }
    }
  }
  return range;
}

// Cells with an active one at most `radius` away along an axis. `stride`, `count`: of that axis.
std::vector<std::uint8_t> Grow(const std::vector<std::uint8_t>& cells, std::size_t stride, std::int32_t count, std::int32_t radius) {
  std::vector<std::uint8_t> grown(cells.size());
  const std::size_t plane = stride * std::size_t(count);
  ParallelFor(0, cells.size() / plane, [&](std::size_t number) {
    for (std::int32_t i = 0; i < count; ++i) {
      std::uint8_t* const to = &grown[number * plane + std::size_t(i) * stride];
      for (std::int32_t j = std::max(i - radius, 0); j <= std::min(i + radius, count - 1); ++j) {
        const std::uint8_t* const from = &cells[number * plane + std::size_t(j) * stride];
        for (std::size_t n = 0; n < stride; ++n) to[n] = std::uint8_t(to[n] | from[n]);
      }
    }
  });
  return grown;
}

}  // namespace

VoxelRanges FindVoxelRanges(const VoxelBricks& voxels) {
  static_assert(kBrick % kRangeSide == 0);
  const Box& box = voxels.box();
  VoxelRanges result;
  for (const Axis axis : kAxes) {
    result.first[axis] = FloorDiv(box.begin[axis], kRangeSide);
    result.counts[axis] = FloorDiv(box.end[axis] - 1, kRangeSide) + 1 - result.first[axis];
  }
  result.ranges.resize(CountIn(result.counts));
  VisitScalarType(voxels.type(), [&]<class T>(const T*) {
    const BrickGrid& grid = voxels.grid();
    ForEachRowOfBricks(grid, [&](Index3 brick) {
      for (; brick.x < grid.first.x + grid.counts.x; ++brick.x) {
        const BrickView<T> view = voxels.View<T>(brick);
        const Box of = grid.BoxOf(brick);
        Index3 cube;
        for (cube.z = FloorDiv(of.begin.z, kRangeSide); kRangeSide * cube.z < of.end.z; ++cube.z) {
          for (cube.y = FloorDiv(of.begin.y, kRangeSide); kRangeSide * cube.y < of.end.y; ++cube.y) {
            for (cube.x = FloorDiv(of.begin.x, kRangeSide); kRangeSide * cube.x < of.end.x; ++cube.x) {
              const Box inside = Intersection(of, {kRangeSide * cube, kRangeSide * (cube + Uniform(1))});
              result.ranges[NumberIn(result.counts, cube - result.first)] = RangeIn(view, inside);
            }
          }
        }
      }
    });
  });
  return result;
}

bool ActiveMacrocells::Any(float x_low, float x_high, float y_low, float y_high, float z) const {
  const auto cell = [&](std::size_t i, float p) {
    const float number = std::floor(p * (1.0F / kCell)) - float(first[i]);
    return std::int32_t(std::clamp(number, 0.0F, float(counts[i] - 1)));
  };
  const std::int32_t x_begin = cell(0, x_low), x_last = cell(0, x_high), y_last = cell(1, y_high);
  const std::size_t slice = std::size_t(cell(2, z)) * std::size_t(counts[1]);
  for (std::int32_t y = cell(1, y_low); y <= y_last; ++y) {
    const std::uint8_t* const row = &active[(slice + std::size_t(y)) * std::size_t(counts[0])];
    for (std::int32_t x = x_begin; x <= x_last; ++x) {
      if (row[x] != 0) return true;
    }
  }
  return false;
}

ActiveMacrocells FindActiveMacrocells(const VoxelRanges& ranges, const VisibleSamples& visible, const std::array<Axis, 3>& axes) {
  // In cubes, by place in `axes`. A sample is made from voxels up to 6, 4 and 2 away (ShearPasses: "Reach"), by way of lattice points on
  // its ray that lie less than 2 slices away.
  constexpr std::int32_t kReach[3] = {2, 2, 1};
  const Index3& counts = ranges.counts;
  std::vector<std::uint8_t> near(ranges.ranges.size());
  ParallelFor(0, std::size_t(counts.z), [&](std::size_t z) {
    const std::size_t plane = std::size_t(counts.x) * std::size_t(counts.y);
    for (std::size_t i = z * plane; i < (z + 1) * plane; ++i) {
      const MacrocellRange& range = ranges.ranges[i];
      // Between a lower sample somewhere and the largest one here lie all values between them.
      near[i] = range.min <= range.max && visible.AnyBetween(-std::numeric_limits<float>::max(), range.max);
    }
  });
  const std::size_t strides[3] = {1, std::size_t(counts.x), std::size_t(counts.x) * std::size_t(counts.y)};
  for (std::size_t i = 0; i < 3; ++i) near = Grow(near, strides[Number(axes[i])], counts[axes[i]], kReach[i]);

  constexpr std::int32_t kCubes = kCell / kRangeSide;
  ActiveMacrocells result;
  std::size_t cells = 1;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int32_t begin = ranges.first[axes[i]], end = begin + counts[axes[i]];
    result.first[i] = FloorDiv(begin, kCubes);
    result.counts[i] = FloorDiv(end - 1, kCubes) + 1 - result.first[i];
    cells *= std::size_t(result.counts[i]);
  }
  result.active.resize(cells);
  std::size_t number = 0;
  Index3 cube;
  const auto cell_of = [&](std::size_t i) {
    return std::size_t(FloorDiv(cube[axes[i]] + ranges.first[axes[i]], kCubes) - result.first[i]);
  };
  for (cube.z = 0; cube.z < counts.z; ++cube.z) {
    for (cube.y = 0; cube.y < counts.y; ++cube.y) {
      for (cube.x = 0; cube.x < counts.x; ++cube.x, ++number) {
        if (near[number] == 0) continue;
        const Index3 place = cube + ranges.first;
        result.hull = Hull(result.hull, {kRangeSide * place, kRangeSide * (place + Uniform(1))});
        result.active[(cell_of(2) * std::size_t(result.counts[1]) + cell_of(1)) * std::size_t(result.counts[0]) + cell_of(0)] = 1;
      }
    }
  }
  return result;
}

}  // namespace slabstream::shear
