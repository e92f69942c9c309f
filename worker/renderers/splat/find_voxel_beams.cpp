// FindVoxelBeams: a pass over the bricks that may hold anything, with a row of bricks along x as a task, marks occupied voxels. This
// determines where each beam's records begin. RecordsOfBricks makes the records of a brick.
#include <algorithm>
#include <array>
#include <bit>

#include "common/volume/indices.h"
#include "common/volume/occupancy_grid.h"
#include "worker/kernels/brick_normals.h"
#include "worker/renderers/splat/occupied_voxels.h"

namespace slabstream {
namespace {

static_assert(kCellVoxels == 32, "masks are 32 bits");
static_assert(kCellVoxels % kBrick == 0, "a brick's row lies in one cell");
static_assert(kNormalRow == kBrick && kSelectRow == kBrick);

using RowMasks = std::array<std::uint16_t, kBrick>;  // bit i of [y]: a property of the brick's voxel i of row y

template <class T>
class BeamFinder {
 public:
  BeamFinder(const VoxelBricks& voxels, const BrickRanges& ranges, const BinLookup<T>& lookup)
      : voxels_(voxels), grid_(voxels.grid()), lookup_(lookup), intervals_(lookup.Intervals()), shows_(grid_.size()) {
    for (const Index3& brick : IndicesIn(Box{grid_.first, grid_.first + grid_.counts})) {
      const BrickRanges::Range& range = ranges.Of(brick);
      if (!lookup.AnyBetween(range.min, range.max)) continue;
      shows_[grid_.Number(brick)] = 1;
      beams_.box = Hull(beams_.box, grid_.BoxOf(brick));
    }
  }

  VoxelBeams Find() && {
    const Box& box = beams_.box;
    if (box.empty()) return std::move(beams_);
    beams_.first_cell = box.begin.x / kCellVoxels;
    beams_.cell_count = (box.end.x - 1) / kCellVoxels + 1 - beams_.first_cell;
    beams_.beam_count = std::size_t(box.size().y) * std::size_t(box.size().z);
    beams_.masks = MakeLargeArray<std::uint32_t>(beams_.cells());
    beams_.first_record = MakeLargeArray<std::uint64_t>(beams_.beam_count + 1);
    const BrickGrid bricks(box);
    ForEachRowOfBricks(bricks, [this](const Index3& first) { Mark(first); });
    std::uint64_t total = 0;
    for (std::size_t beam = 0; beam <= beams_.beam_count; ++beam) {
      const std::uint64_t count = beam < beams_.beam_count ? beams_.first_record[beam] : 0;
      beams_.first_record[beam] = total;
      total += count;
    }
    beams_.records = MakeLargeArray<VoxelRecord>(total);
    return std::move(beams_);
  }

 private:
  // The row's bricks that may hold anything.
  template <class Function>
  void ForEachShown(Index3 brick, Function&& function) const {
    for (const std::int32_t end = (beams_.box.end.x - 1) / kBrick + 1; brick.x < end; ++brick.x) {
      if (shows_[grid_.Number(brick)] != 0) function(brick);
    }
  }

  std::size_t BeamOf(std::int32_t y, std::int32_t z) const {
    return std::size_t(z - beams_.box.begin.z) * beams_.Stride(Axis::kZ) + std::size_t(y - beams_.box.begin.y);
  }
  std::uint32_t* MasksOf(std::size_t beam) const { return &beams_.masks[beam * std::size_t(beams_.cell_count)]; }
  std::size_t CellOf(std::int32_t x) const { return std::size_t(x / kCellVoxels - beams_.first_cell); }

  // Sets the masks of the row's beams, and, for now, the number of their records in first_record.
  void Mark(const Index3& first_brick) {
    const Box row = grid_.BoxOf(first_brick);
    const auto cell_count = std::size_t(beams_.cell_count);
    for (std::int32_t z = row.begin.z; z < row.end.z; ++z) {
      std::fill_n(MasksOf(BeamOf(row.begin.y, z)), std::size_t(row.size().y) * cell_count, 0U);
    }
    ForEachShown(first_brick, [&](const Index3& brick) {
      const BrickView<T> view = voxels_.View<T>(brick);
      const Box box = grid_.BoxOf(brick);
      const std::int32_t width = box.size().x, height = box.size().y;
      for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
        RowMasks masks{};
        Select(view.Row(box.begin.y, z), view.y_stride, width, height, masks);
        std::uint32_t* cell = MasksOf(BeamOf(box.begin.y, z)) + CellOf(box.begin.x);
        for (std::int32_t y = 0; y < height; ++y, cell += cell_count) {
          *cell |= std::uint32_t{masks[std::size_t(y)]} << (box.begin.x % kCellVoxels);
        }
      }
    });
    for (std::int32_t z = row.begin.z; z < row.end.z; ++z) {
      for (std::int32_t y = row.begin.y; y < row.end.y; ++y) {
        const std::size_t beam = BeamOf(y, z);
        const std::uint32_t* masks = MasksOf(beam);
        std::uint32_t records = 0;  // a beam has at most kMaxVolumeSide
        for (std::size_t cell = 0; cell < cell_count; ++cell) records += std::uint32_t(std::popcount(masks[cell]));
        beams_.first_record[beam] = records;
      }
    }
  }

  void Select(const T* samples, std::ptrdiff_t stride, std::int32_t width, std::int32_t height, RowMasks& masks) const {
    constexpr std::size_t kFewIntervals = 4;
    if (width == kBrick && intervals_.size() <= kFewIntervals) {
      SelectSamples<T>(samples, stride, height, intervals_, masks.data());
      return;
    }
    for (std::int32_t y = 0; y < height; ++y, samples += stride) {
      for (std::int32_t x = 0; x < width; ++x) {
        masks[std::size_t(y)] = std::uint16_t(masks[std::size_t(y)] | std::uint32_t{lookup_(samples[x]) != kNotSelected} << x);
      }
    }
  }

  const VoxelBricks& voxels_;
  const BrickGrid& grid_;
  const BinLookup<T>& lookup_;
  const std::vector<SampleInterval<T>> intervals_;
  std::vector<std::uint8_t> shows_;  // by brick: 1 if it may hold a selected sample
  VoxelBeams beams_;
};

// `beams` have their masks and places of records, and memory for the records. Its arrays stay where they are when it is moved.
template <class T>
class RecordsOfBricks : public BrickRecords {
 public:
  RecordsOfBricks(const VoxelBricks& voxels, const ClassificationTable& table, const BinSelection& selection, const Vec3& spacing,
                  const VoxelBeams& beams)
      : BrickRecords(voxels, beams.box),
        table_(table),
        selection_(selection),
        spacing_(spacing),
        all_(voxels.box()),
        box_(beams.box),
        first_cell_(beams.first_cell),
        cell_count_(std::size_t(beams.cell_count)),
        z_stride_(beams.Stride(Axis::kZ)),
        masks_(beams.masks.get()),
        first_record_(beams.first_record.get()),
        records_(beams.records.get()) {}

 private:
  void Make(const Index3& brick) const override {
    const Box box = voxels().grid().BoxOf(brick);
    const BrickView<T> view = voxels().View<T>(brick);
    const auto height = std::size_t(box.size().y);
    const std::int32_t shift = box.begin.x % kCellVoxels;
    const std::uint32_t width_bits = (std::uint32_t{1} << box.size().x) - 1;
    const auto cell = std::size_t(box.begin.x / kCellVoxels - first_cell_);
    NormalScales scales = ScalesIn(box);
    std::array<NormalSums, 3> planes;        // of z: [z % 3]
    std::int32_t summed_end = all_.begin.z;  // earlier planes are already summed, if they are needed again
    for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
      RowMasks masks;
      std::uint32_t rows = 0;
      const std::size_t first_beam = std::size_t(z - box_.begin.z) * z_stride_ + std::size_t(box.begin.y - box_.begin.y);
      for (std::size_t y = 0; y < height; ++y) {
        masks[y] = std::uint16_t(MasksOf(first_beam + y)[cell] >> shift & width_bits);
        rows |= std::uint32_t{masks[y] != 0} << y;
      }
      if (rows == 0) continue;
      const std::int32_t below = std::max(z - 1, all_.begin.z), above = std::min(z + 1, all_.end.z - 1);
      for (summed_end = std::max(summed_end, below); summed_end <= above; ++summed_end) {
        NormalSamples<T> samples;
        LoadPlane(box, brick, summed_end, samples);
        SumPlane(samples, planes[std::size_t(summed_end % 3)]);
      }
      scales.z = ScaleAt(Axis::kZ, z);
      std::uint16_t codes[kBrick][kBrick];
      EncodeNormals(planes[std::size_t(below % 3)], planes[std::size_t(z % 3)], planes[std::size_t(above % 3)], scales, rows, codes);
      for (; rows != 0; rows &= rows - 1) {
        const auto y = std::size_t(std::countr_zero(rows));
        const std::uint64_t place = first_record_[first_beam + y] + RecordsBefore(MasksOf(first_beam + y), cell, shift);
        WriteRecords(masks[y], view.Row(box.begin.y + std::int32_t(y), z), codes[y], &records_[place]);
      }
    }
  }

  const std::uint32_t* MasksOf(std::size_t beam) const { return &masks_[beam * cell_count_]; }

  // Of a beam's records, those of voxels before bit `shift` of a cell.
  static std::uint64_t RecordsBefore(const std::uint32_t* masks, std::size_t cell, std::int32_t shift) {
    std::uint64_t count = std::uint64_t(CountOf(masks[cell] & ((std::uint32_t{1} << shift) - 1)));
    std::size_t i = 0;
    for (; i + 2 <= cell; i += 2) count += std::uint64_t(CountOf(masks[i] | std::uint64_t{masks[i + 1]} << kCellVoxels));
    return i < cell ? count + std::uint64_t(CountOf(masks[i])) : count;
  }

  void WriteRecords(std::uint32_t mask, const T* samples, const std::uint16_t* codes, VoxelRecord* out) const {
    if (mask == 0xFFFF) {
      for (std::size_t i = 0; i < std::size_t{kBrick}; ++i) out[i] = {lookup_(samples[i]), codes[i]};
      return;
    }
    for (; mask != 0; mask &= mask - 1) {
      const auto i = std::size_t(std::countr_zero(mask));
      *out++ = {lookup_(samples[i]), codes[i]};
    }
  }

  // A plane of the brick with one more voxel on each side.
  void LoadPlane(const Box& box, const Index3& brick, std::int32_t z, NormalSamples<T>& samples) const {
    const bool has_left = box.begin.x > all_.begin.x, has_right = box.end.x < all_.end.x;
    const std::int32_t width = box.size().x;
    BrickView<T> middle, left, right;
    std::int32_t row_of_views = -1;
    for (std::int32_t y = box.begin.y - 1; y <= box.end.y; ++y) {
      const std::int32_t inside = std::clamp(y, all_.begin.y, all_.end.y - 1);
      if (inside / kBrick != row_of_views) {
        row_of_views = inside / kBrick;
        const std::int32_t layer = z / kBrick;
        middle = voxels().View<T>({brick.x, row_of_views, layer});
        if (has_left) left = voxels().View<T>({brick.x - 1, row_of_views, layer});
        if (has_right) right = voxels().View<T>({brick.x + 1, row_of_views, layer});
      }
      const T* from = middle.Row(inside, z);
      T* to = samples.row[y - box.begin.y + 1];
      std::copy_n(from, width, to + 1);
      to[0] = has_left ? left.Row(inside, z)[box.begin.x - left.begin.x - 1] : from[0];
      to[width + 1] = has_right ? right.Row(inside, z)[0] : from[width - 1];
    }
  }

  float ScaleAt(Axis axis, std::int32_t at) const {
    const int steps = int(at > all_.begin[axis]) + int(at + 1 < all_.end[axis]);
    return steps == 0 ? 0.0F : float(1 / (steps * spacing_[axis]));
  }
  NormalScales ScalesIn(const Box& box) const {
    NormalScales scales;
    for (std::int32_t i = 0; i < box.size().x; ++i) scales.x[std::size_t(i)] = ScaleAt(Axis::kX, box.begin.x + i);
    for (std::int32_t i = 0; i < box.size().y; ++i) scales.y[std::size_t(i)] = ScaleAt(Axis::kY, box.begin.y + i);
    return scales;
  }

  const ClassificationTable table_;
  const BinSelection selection_;
  const BinLookup<T> lookup_{table_, selection_};
  const Vec3 spacing_;
  const Box all_, box_;  // of the voxels; of the beams
  const std::int32_t first_cell_;
  const std::size_t cell_count_, z_stride_;
  const std::uint32_t* const masks_;
  const std::uint64_t* const first_record_;
  VoxelRecord* const records_;
};

}  // namespace

VoxelBeams FindVoxelBeams(const VoxelBricks& voxels, const BrickRanges& bricks, const ClassificationTable& table,
                          const BinSelection& selection, const Vec3& spacing) {
  return VisitScalarType(voxels.type(), [&]<class T>(const T*) {
    const BinLookup<T> lookup(table, selection);
    VoxelBeams beams = BeamFinder<T>(voxels, bricks, lookup).Find();
    if (!beams.box.empty()) beams.to_make = std::make_unique<RecordsOfBricks<T>>(voxels, table, selection, spacing, beams);
    return beams;
  });
}

}  // namespace slabstream
