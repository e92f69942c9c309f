// OccupiedVoxels: the occupied voxels of a padded box in the order in which a traversal axis visits them: slice by slice, beam by beam,
// along each beam.
//
// In-slice axes: u, along beams, is the lower of the two axes that are not the traversal axis, v the higher one. A cell is kCellVoxels = 32
// voxels of a beam from a global multiple of 32 on, stored as a 32-bit mask of the occupied ones. So a beam costs a bit per voxel and four
// bytes per occupied voxel, for dense and sparse data alike. A voxel's record is found by counting bits from the beam's first cell on. Each
// record has its place from the beginning, but is made when its brick is first needed (BrickRecords).
//
// Traversals along z and along y visit the same beams, those along x, in different orders. So VoxelBeams are kept for two directions only:
// along x, found in the voxels (FindVoxelBeams), and along y, for traversal along x, made from those (TurnVoxelBeams).
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/memory/large_array.h"
#include "common/view/sheet_grid.h"
#include "common/volume/bricks.h"
#include "worker/kernels/voxel_record.h"
#include "worker/renderers/bin_lookup.h"
#include "worker/renderers/brick_ranges.h"

namespace slabstream {

// Makes the records of a brick when a frame first needs one of them. Most voxels of an opaque volume lie behind others: their records are
// never made, and memory for them is not taken.
class BrickRecords {
  enum State : std::uint8_t { kNone, kBeingMade, kMade };

 public:
  // Of the bricks that touch `box`, which lies in that of the voxels.
  BrickRecords(const VoxelBricks& voxels, const Box& box) : voxels_(voxels), grid_(box), states_(grid_.size()) {}
  virtual ~BrickRecords() = default;
  BrickRecords(const BrickRecords&) = delete;
  BrickRecords& operator=(const BrickRecords&) = delete;

  // Call before a frame's first Need: the voxels may lie elsewhere than before. They must stay until its last Need.
  void SetVoxels(const VoxelBricks& voxels) { voxels_ = voxels; }

  // A row of bricks along x: a frame asks for each octet that it draws.
  class Row {
   public:
    bool Has(std::int32_t x) const { return states_[x - first_x_].load(std::memory_order_acquire) == kMade; }

   private:
    friend class BrickRecords;
    Row(const std::atomic<std::uint8_t>* states, std::int32_t first_x) : states_(states), first_x_(first_x) {}

    const std::atomic<std::uint8_t>* states_;
    std::int32_t first_x_;
  };
  Row RowAt(std::int32_t y, std::int32_t z) const { return {&states_[grid_.Number({grid_.first.x, y, z})], grid_.first.x}; }
  void Need(const Index3& brick);  // any thread
  void NeedAll();                  // parallel
  std::size_t bytes() const { return states_.size(); }

 protected:
  virtual void Make(const Index3& brick) const = 0;  // one call for each brick
  const VoxelBricks& voxels() const { return voxels_; }

 private:
  VoxelBricks voxels_;
  const BrickGrid grid_;
  std::vector<std::atomic<std::uint8_t>> states_;  // by brick
};

inline constexpr std::int32_t kCellVoxels = 32, kCellOctets = kCellVoxels / kOctet;

// All beams of a padded box along `u`. Tasks fill the arrays in parallel.
struct VoxelBeams {
  Axis u = Axis::kX, inner = Axis::kY;          // beams are numbered [the third axis][inner]
  Box box;                                      // holds all occupied voxels, and little else; empty if there are none
  std::int32_t first_cell = 0, cell_count = 0;  // along u: cell i begins at voxel 32 * (first_cell + i)
  std::size_t beam_count = 0;
  LargeArray<std::uint32_t> masks;         // [beam][cell]
  LargeArray<std::uint64_t> first_record;  // [beam], and one more: index of the beam's first record
  LargeArray<VoxelRecord> records;
  std::unique_ptr<BrickRecords> to_make;  // null: all records are there

  std::size_t Stride(Axis axis) const { return axis == inner ? 1 : std::size_t(box.size()[inner]); }  // from beam to beam
  std::size_t cells() const { return beam_count * std::size_t(cell_count); }
  std::size_t record_count() const { return beam_count == 0 ? 0 : std::size_t(first_record[beam_count]); }
  std::size_t bytes() const;
};

// Makes no record yet (VoxelBeams::to_make). A voxel is occupied if `selection` holds its bin. Normals are those of the data's gradient by
// smoothed central differences (docs/rendering.md) over physical spacing. They are one-sided at the border of the given voxels, which is
// the volume's border or lies inside the halo where nothing is read. Parallel; the result is the same for any number of threads.
VoxelBeams FindVoxelBeams(const VoxelBricks& voxels, const BrickRanges& bricks, const ClassificationTable& table,
                          const BinSelection& selection, const Vec3& spacing);

// The same voxels, from beams along x, all records of which are there, in beams along y, [x][z].
VoxelBeams TurnVoxelBeams(const VoxelBeams& along_x);

// The cells of one traversal axis; refers to beams, which must outlive it.
struct OccupiedVoxels {
  SliceAxes axes{};
  Box box;       // the box of the beams, limited to the wanted slices
  Box occupied;  // bounding box of the voxels found in it; empty if there are none
  std::int32_t first_cell = 0, cell_count = 0;
  std::size_t slice_stride = 0, row_stride = 0;  // beams
  std::size_t first_beam = 0;
  const std::uint32_t* masks = nullptr;
  std::span<const std::uint64_t> first_record;
  std::span<const VoxelRecord> records;
  BrickRecords* to_make = nullptr;    // of the beams
  std::uint64_t occupied_in_box = 0;  // voxels found inside the wanted box, not in its halo

  // `slice` and `v` are inside `box`.
  std::size_t Beam(std::int32_t slice, std::int32_t v) const {
    return first_beam + std::size_t(slice - box.begin[axes.c]) * slice_stride + std::size_t(v - box.begin[axes.v]) * row_stride;
  }
  const std::uint32_t* Masks(std::size_t beam) const { return &masks[beam * std::size_t(cell_count)]; }
};

// For the slices of `wanted`. `beams` lie along the u of `traversal`.
OccupiedVoxels VoxelsOf(const VoxelBeams& beams, Axis traversal, const Box& wanted);

}  // namespace slabstream
