// OccupiedCells: the occupied voxels of a slab in the order in which a traversal axis visits them: slice by slice, beam by beam, along each
// beam.
//
// In-slice axes: u, along beams, is the lower of the two axes that are not the traversal axis, v the higher one. A cell is kFootprintCell =
// 32 voxels of a beam from a global multiple of 32 on: a 32-bit mask of which are occupied. So a beam costs one and a half bits a voxel and
// four bytes an occupied voxel, dense and sparse data alike, and a cell's voxels are a mask and a pointer.
#pragma once

#include <cstdint>
#include <vector>

#include "common/base/aligned_buffer.h"
#include "common/volume/volume.h"
#include "worker/kernels/voxel_batch.h"
#include "worker/render/bin_lookup.h"
#include "worker/render/brick_ranges.h"

namespace slabstream {

struct SliceAxes {
  Axis c, u, v;  // traversal axis, along beams, from beam to beam
};
constexpr SliceAxes AxesOf(Axis traversal) {
  return {traversal, traversal == Axis::kX ? Axis::kY : Axis::kX, traversal == Axis::kZ ? Axis::kY : Axis::kZ};
}

struct OccupiedCells {
  SliceAxes axes{};
  Box box;                                      // voxels that were looked at: the slab, cut to the slices of the box
  Box occupied;                                 // bounding box of those found; empty if there are none
  std::int32_t first_cell = 0, cell_count = 0;  // along u: cell i begins at voxel 32 * (first_cell + i)
  std::vector<std::uint32_t> masks;             // [slice][beam][cell], from box.begin on
  std::vector<std::uint16_t> record_offsets;    // likewise: records of the beam before this cell, so that cells can be skipped unread
  std::vector<std::uint64_t> first_record;      // [slice][beam], and one more: index of the beam's first record
  AlignedVector<VoxelRecord> records;
  std::uint64_t occupied_in_box = 0;  // of those, the ones inside the box, not in its halo

  std::size_t Beam(std::int32_t slice, std::int32_t v) const {
    return std::size_t(slice - box.begin[axes.c]) * std::size_t(box.end[axes.v] - box.begin[axes.v]) + std::size_t(v - box.begin[axes.v]);
  }
  const std::uint32_t* Masks(std::size_t beam) const { return &masks[beam * std::size_t(cell_count)]; }
  const std::uint16_t* RecordOffsets(std::size_t beam) const { return &record_offsets[beam * std::size_t(cell_count)]; }
  std::size_t bytes() const {
    return masks.capacity() * sizeof(masks[0]) + record_offsets.capacity() * sizeof(record_offsets[0]) +
           first_record.capacity() * sizeof(first_record[0]) + records.capacity() * sizeof(VoxelRecord);
  }
};

// In the slices of `box`, with the halo of each slice. Occupied: `selection` holds the voxel's bin. Normals are those of the data's
// gradient by smoothed central differences (docs/rendering.md) over physical spacing, one-sided at the border of the voxels at hand (which
// is the volume's border, or inside the halo where nothing is read).
OccupiedCells FindOccupiedCells(const VoxelBlock& voxels, const BrickRanges& bricks, const ClassificationTable& table,
                                const BinSelection& selection, const Vec3& spacing, Axis traversal, const Box& box);

}  // namespace slabstream
