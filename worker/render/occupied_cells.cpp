#include "worker/render/occupied_cells.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <type_traits>
#include <utility>

#include "worker/kernels/normal_code.h"

namespace slabstream {
namespace {

constexpr std::int32_t kCell = kFootprintCell;
static_assert(kCell == 32, "masks are 32 bits");
static_assert(kCell % BrickRanges::kBrick == 0, "a brick's row lies in one cell");

// Normal codes of a row of at most kBrick voxels: the gradient of Zucker and Hummel (1981), along each axis the difference of the two
// neighbouring slices, smoothed by (1, 2, 1) along the other two. Each of the 3 x 3 rows round the row is read once, column by column: what
// is shared along y and z is summed before x comes in. Voxels outside are as their nearest ones inside. The smoothing's factor 16 is the
// same for all axes and left in: only the direction is kept.
template <class T>
class RowNormals {
 public:
  RowNormals(const VoxelBlock& voxels, const Vec3& spacing) : box_(voxels.box), samples_(voxels.samples<T>()), spacing_(spacing) {
    const Index3 size = box_.size();
    strides_ = {1, size.x, std::int64_t{1} * size.x * size.y};
  }

  void Compute(const Index3& first, std::int32_t count, std::uint16_t* codes) const {
    const Neighbours y = Along(Axis::kY, first), z = Along(Axis::kZ, first);
    const T* middle = samples_ + (first.z - box_.begin.z) * strides_[2] + (first.y - box_.begin.y) * strides_[1] + (first.x - box_.begin.x);
    const T* below = middle + z.below;
    const T* above = middle + z.above;

    // Column i holds what x = first.x + i - 1 adds.
    Columns smooth, along_y, along_z;
    const std::int32_t begin = first.x > box_.begin.x ? 0 : 1, end = first.x + count < box_.end.x ? count + 2 : count + 1;
    for (std::int32_t i = begin; i < end; ++i) {
      const auto row = [&](const T* centre) {
        const float a = float(centre[i - 1 + y.below]), b = float(centre[i - 1]), c = float(centre[i - 1 + y.above]);
        return std::pair(Smooth(a, b, c), c - a);
      };
      const auto [smooth_below, y_below] = row(below);
      const auto [smooth_middle, y_middle] = row(middle);
      const auto [smooth_above, y_above] = row(above);
      smooth[std::size_t(i)] = Smooth(smooth_below, smooth_middle, smooth_above);
      along_y[std::size_t(i)] = Smooth(y_below, y_middle, y_above);
      along_z[std::size_t(i)] = smooth_above - smooth_below;
    }
    for (Columns* columns : {&smooth, &along_y, &along_z}) {
      if (begin == 1) (*columns)[0] = (*columns)[1];
      if (end == count + 1) (*columns)[std::size_t(end)] = (*columns)[std::size_t(count)];
    }

    const auto code = [&](std::size_t i, float x_scale) {
      return EncodeNormal(x_scale * (smooth[i + 2] - smooth[i]), y.scale * Smooth(along_y[i], along_y[i + 1], along_y[i + 2]),
                          z.scale * Smooth(along_z[i], along_z[i + 1], along_z[i + 2]));
    };
    const auto inner_scale = float(0.5 / spacing_.x);
    for (std::size_t i = 0; i < std::size_t(count); ++i) codes[i] = code(i, inner_scale);
    // The ends of the whole row have one neighbour along x.
    if (begin == 1) codes[0] = code(0, Along(Axis::kX, first).scale);
    if (end == count + 1) codes[count - 1] = code(std::size_t(count - 1), Along(Axis::kX, {first.x + count - 1, first.y, first.z}).scale);
  }

 private:
  using Columns = std::array<float, BrickRanges::kBrick + 2>;

  struct Neighbours {
    std::int64_t above, below;  // sample offsets of the two neighbours, or of the voxel itself at a border
    float scale;                // 1 / physical distance of the two; 0 if both are the voxel itself
  };
  Neighbours Along(Axis axis, const Index3& voxel) const {
    const bool has_above = voxel[axis] + 1 < box_.end[axis], has_below = voxel[axis] > box_.begin[axis];
    const std::int64_t stride = strides_[std::size_t(Number(axis))];
    const int steps = int(has_above) + int(has_below);
    return {has_above ? stride : 0, has_below ? -stride : 0, steps == 0 ? 0.0F : float(1 / (steps * spacing_[axis]))};
  }

  static float Smooth(float below, float middle, float above) { return below + above + 2 * middle; }

  Box box_;
  const T* samples_;
  Vec3 spacing_;
  std::array<std::int64_t, 3> strides_{};
};

// Calls function(first voxel, count, samples) for each brick's row that may hold selected samples, in memory order.
template <class T, class Function>
void ForEachBrickRow(const VoxelBlock& voxels, const Box& box, const BrickRanges& bricks, const BinLookup<T>& lookup, Function&& function) {
  constexpr std::int32_t kBrick = BrickRanges::kBrick;
  for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
    for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
      for (std::int32_t x = box.begin.x; x < box.end.x;) {
        const std::int32_t end = std::min((x / kBrick + 1) * kBrick, box.end.x);
        const BrickRanges::Range& range = bricks.At(x, y, z);
        if (lookup.AnyBetween(range.min, range.max)) function(Index3{x, y, z}, end - x, voxels.samples<T>() + voxels.Offset({x, y, z}));
        x = end;
      }
    }
  }
}

template <class T>
void MarkOccupied(const VoxelBlock& voxels, const BrickRanges& bricks, const BinLookup<T>& lookup, OccupiedCells& cells) {
  const Axis u = cells.axes.u;
  ForEachBrickRow(voxels, cells.box, bricks, lookup, [&](const Index3& first, std::int32_t count, const T* samples) {
    const std::size_t cell = std::size_t(first[u] / kCell - cells.first_cell);
    if (u == Axis::kX) {  // the row lies along a beam
      std::uint32_t mask = 0;
      for (std::int32_t i = 0; i < count; ++i) mask |= std::uint32_t{lookup(samples[i]) != kNotSelected} << ((first.x + i) % kCell);
      cells.masks[cells.Beam(first[cells.axes.c], first[cells.axes.v]) * std::size_t(cells.cell_count) + cell] |= mask;
    } else {  // the row crosses slices
      const std::uint32_t bit = std::uint32_t{1} << (first[u] % kCell);
      const std::size_t slice_stride = cells.Beam(cells.box.begin.x + 1, cells.box.begin[cells.axes.v]) * std::size_t(cells.cell_count);
      std::uint32_t* mask = &cells.masks[cells.Beam(first.x, first[cells.axes.v]) * std::size_t(cells.cell_count) + cell];
      for (std::int32_t i = 0; i < count; ++i, mask += slice_stride) {
        if (lookup(samples[i]) != kNotSelected) *mask |= bit;
      }
    }
  });
}

// Sums of the masks: first_record, record_offsets and the bounding box.
void CountRecords(OccupiedCells& cells) {
  const auto [c, u, v] = cells.axes;
  constexpr std::int32_t kFar = std::numeric_limits<std::int32_t>::max();
  cells.occupied = {{kFar, kFar, kFar}, {0, 0, 0}};
  std::uint64_t total = 0;
  std::size_t beam = 0;
  for (std::int32_t slice = cells.box.begin[c]; slice < cells.box.end[c]; ++slice) {
    for (std::int32_t row = cells.box.begin[v]; row < cells.box.end[v]; ++row, ++beam) {
      cells.first_record.push_back(total);
      const std::uint64_t before = total;
      for (std::int32_t cell = 0; cell < cells.cell_count; ++cell) {
        const std::uint32_t mask = cells.Masks(beam)[cell];
        cells.record_offsets.push_back(std::uint16_t(total - before));  // a beam has at most kMaxVolumeSide
        if (mask == 0) continue;
        total += std::uint64_t(std::popcount(mask));
        const std::int32_t origin = (cells.first_cell + cell) * kCell;
        cells.occupied.begin[u] = std::min(cells.occupied.begin[u], origin + std::countr_zero(mask));
        cells.occupied.end[u] = std::max(cells.occupied.end[u], origin + kCell - std::countl_zero(mask));
      }
      if (total == before) continue;
      cells.occupied.begin[c] = std::min(cells.occupied.begin[c], slice);
      cells.occupied.end[c] = slice + 1;
      cells.occupied.begin[v] = std::min(cells.occupied.begin[v], row);
      cells.occupied.end[v] = std::max(cells.occupied.end[v], row + 1);
    }
  }
  cells.first_record.push_back(total);
  if (total == 0) cells.occupied = {};
}

template <class T>
void FillRecords(const VoxelBlock& voxels, const BrickRanges& bricks, const BinLookup<T>& lookup, const Vec3& spacing,
                 OccupiedCells& cells) {
  const RowNormals<T> normals(voxels, spacing);
  // Voxels come in memory order, which within each beam is the order of u: every beam fills up from its first record on.
  std::vector<std::uint64_t> next(cells.first_record.begin(), cells.first_record.end() - 1);
  const std::size_t slice_stride = cells.axes.c == Axis::kX ? cells.Beam(cells.box.begin.x + 1, cells.box.begin[cells.axes.v]) : 0;
  ForEachBrickRow(voxels, cells.box, bricks, lookup, [&](const Index3& first, std::int32_t count, const T* samples) {
    std::array<std::uint16_t, BrickRanges::kBrick> bins, codes;
    bool any = false;
    for (std::int32_t i = 0; i < count; ++i) {
      bins[std::size_t(i)] = lookup(samples[i]);
      any |= bins[std::size_t(i)] != kNotSelected;
    }
    if (!any) return;
    normals.Compute(first, count, codes.data());
    std::uint64_t* beam = &next[cells.Beam(first[cells.axes.c], first[cells.axes.v])];
    for (std::size_t i = 0; i < std::size_t(count); ++i, beam += slice_stride) {
      if (bins[i] != kNotSelected) cells.records[(*beam)++] = {bins[i], codes[i]};
    }
  });
}

// Occupied voxels inside `inside`.
std::uint64_t CountInside(const OccupiedCells& cells, const Box& inside) {
  const auto [c, u, v] = cells.axes;
  const Box part = Intersection(inside, cells.box);
  std::uint64_t count = 0;
  for (std::int32_t slice = part.begin[c]; slice < part.end[c]; ++slice) {
    for (std::int32_t row = part.begin[v]; row < part.end[v]; ++row) {
      const std::uint32_t* masks = cells.Masks(cells.Beam(slice, row));
      for (std::int32_t cell = part.begin[u] / kCell; cell * kCell < part.end[u]; ++cell) {
        const std::int32_t begin = std::max(part.begin[u] - cell * kCell, 0), end = std::min(part.end[u] - cell * kCell, kCell);
        const std::uint64_t wanted = (std::uint64_t{1} << end) - (std::uint64_t{1} << begin);
        count += std::uint64_t(std::popcount(masks[cell - cells.first_cell] & std::uint32_t(wanted)));
      }
    }
  }
  return count;
}

}  // namespace

OccupiedCells FindOccupiedCells(const VoxelBlock& voxels, const BrickRanges& bricks, const ClassificationTable& table,
                                const BinSelection& selection, const Vec3& spacing, Axis traversal, const Box& box) {
  OccupiedCells cells;
  cells.axes = AxesOf(traversal);
  cells.box = voxels.box;
  cells.box.begin[traversal] = std::max(box.begin[traversal], voxels.box.begin[traversal]);
  cells.box.end[traversal] = std::min(box.end[traversal], voxels.box.end[traversal]);
  if (cells.box.empty()) {
    cells.box = {};
    return cells;
  }
  const Axis u = cells.axes.u, v = cells.axes.v;
  cells.first_cell = cells.box.begin[u] / kCell;
  cells.cell_count = (cells.box.end[u] - 1) / kCell + 1 - cells.first_cell;
  const std::size_t beams = std::size_t(cells.box.size()[traversal]) * std::size_t(cells.box.size()[v]);
  cells.masks.assign(beams * std::size_t(cells.cell_count), 0);
  cells.record_offsets.reserve(cells.masks.size());
  cells.first_record.reserve(beams + 1);
  VisitScalarType(voxels.type, [&](auto* type) {
    using T = std::remove_cvref_t<decltype(*type)>;
    const BinLookup<T> lookup(table, selection);
    MarkOccupied<T>(voxels, bricks, lookup, cells);
    CountRecords(cells);
    cells.records.resize(cells.first_record.back());
    FillRecords<T>(voxels, bricks, lookup, spacing, cells);
    cells.occupied_in_box = CountInside(cells, box);
  });
  return cells;
}

}  // namespace slabstream
