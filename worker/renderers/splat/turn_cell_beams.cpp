// TurnVoxelBeams: transposes masks 32 x 32 voxels at a time and distributes records to their beams. Slices of one z go to beams of their
// own, so they are the tasks.

#include <algorithm>
#include <array>
#include <bit>
#include <vector>

#include "common/base/check.h"
#include "common/parallel/parallel.h"
#include "worker/renderers/splat/occupied_voxels.h"

namespace slabstream {
namespace {

using Block = std::array<std::uint32_t, kCellVoxels>;

// Bit i of word j becomes bit j of word i. Exchanges halves of the block, then quarters of each half, and so on (H. S. Warren, Hacker's
// Delight, section 7-3).
void Transpose(Block& block) {
  std::uint32_t low_bits = 0x0000FFFF;
  for (std::size_t width = 16; width != 0; width /= 2, low_bits ^= low_bits << width) {
    for (std::size_t group = 0; group < block.size(); group += 2 * width) {
      for (std::size_t j = group; j < group + width; ++j) {
        const std::uint32_t moved = (block[j] >> width ^ block[j + width]) & low_bits;
        block[j] ^= moved << width;
        block[j + width] ^= moved;
      }
    }
  }
}

void TurnMasks(const VoxelBeams& from, std::int32_t z, VoxelBeams& to) {
  const Box& box = from.box;
  const std::size_t z_beams = std::size_t(z - box.begin.z) * from.Stride(Axis::kZ);
  for (std::int32_t y_cell = 0; y_cell < to.cell_count; ++y_cell) {
    const std::int32_t y_origin = (to.first_cell + y_cell) * kCellVoxels;
    const std::int32_t y_begin = std::max(y_origin, box.begin.y), y_end = std::min(y_origin + kCellVoxels, box.end.y);
    for (std::int32_t x_cell = 0; x_cell < from.cell_count; ++x_cell) {
      const std::int32_t x_origin = (from.first_cell + x_cell) * kCellVoxels;
      Block block{};
      std::uint32_t any = 0;
      for (std::int32_t y = y_begin; y < y_end; ++y) {
        const std::size_t beam = z_beams + std::size_t(y - box.begin.y);
        any |= block[std::size_t(y - y_origin)] = from.masks[beam * std::size_t(from.cell_count) + std::size_t(x_cell)];
      }
      if (any != 0) Transpose(block);
      const std::int32_t x_end = std::min(x_origin + kCellVoxels, box.end.x);
      for (std::int32_t x = std::max(x_origin, box.begin.x); x < x_end; ++x) {
        const std::size_t beam = std::size_t(x - box.begin.x) * to.Stride(Axis::kX) + std::size_t(z - box.begin.z);
        to.masks[beam * std::size_t(to.cell_count) + std::size_t(y_cell)] = block[std::size_t(x - x_origin)];
      }
    }
  }
}

void TurnRecords(const VoxelBeams& from, std::int32_t z, VoxelBeams& to) {
  const Box& box = from.box;
  std::vector<VoxelRecord*> next(std::size_t(box.size().x));  // next record of the beam of each x
  for (std::size_t x = 0; x < next.size(); ++x) {
    next[x] = &to.records[to.first_record[x * to.Stride(Axis::kX) + std::size_t(z - box.begin.z)]];
  }
  VoxelRecord** const at_origin = next.data() - (box.begin.x - from.first_cell * kCellVoxels);
  const std::size_t first_beam = std::size_t(z - box.begin.z) * from.Stride(Axis::kZ);
  for (std::size_t beam = first_beam; beam < first_beam + std::size_t(box.size().y); ++beam) {
    const VoxelRecord* record = &from.records[from.first_record[beam]];
    for (std::int32_t cell = 0; cell < from.cell_count; ++cell) {
      VoxelRecord** const of_cell = at_origin + std::ptrdiff_t{cell} * kCellVoxels;
      for (std::uint32_t rest = from.masks[beam * std::size_t(from.cell_count) + std::size_t(cell)]; rest != 0; rest &= rest - 1) {
        *of_cell[std::countr_zero(rest)]++ = *record++;
      }
    }
  }
}

}  // namespace

VoxelBeams TurnVoxelBeams(const VoxelBeams& along_x) {
  CHECK(along_x.u == Axis::kX && along_x.inner == Axis::kY);
  VoxelBeams turned;
  turned.u = Axis::kY;
  turned.inner = Axis::kZ;
  const Box& box = turned.box = along_x.box;
  if (box.empty()) return turned;
  turned.first_cell = box.begin.y / kCellVoxels;
  turned.cell_count = (box.end.y - 1) / kCellVoxels + 1 - turned.first_cell;
  turned.beam_count = std::size_t(box.size().x) * std::size_t(box.size().z);
  turned.masks = MakeLargeArray<std::uint32_t>(turned.cells());
  turned.first_record = MakeLargeArray<std::uint64_t>(turned.beam_count + 1);
  turned.records = MakeLargeArray<VoxelRecord>(along_x.record_count());

  constexpr std::int32_t kSlices = 8;  // at a time: their beams are neighbours in memory
  const auto for_each_z = [&](auto&& function) {
    ParallelForRanges(box.begin.z, box.end.z, kSlices, [&](std::int32_t begin, std::int32_t end) {
      for (std::int32_t z = begin; z < end; ++z) function(z);
    });
  };
  for_each_z([&](std::int32_t z) { TurnMasks(along_x, z, turned); });
  std::uint64_t total = 0;
  for (std::size_t beam = 0; beam < turned.beam_count; ++beam) {
    turned.first_record[beam] = total;
    for (std::size_t cell = beam * std::size_t(turned.cell_count); cell < (beam + 1) * std::size_t(turned.cell_count); ++cell) {
      total += std::uint32_t(std::popcount(turned.masks[cell]));
    }
  }
  turned.first_record[turned.beam_count] = total;
  CHECK(total == along_x.record_count());
  for_each_z([&](std::int32_t z) { TurnRecords(along_x, z, turned); });
  return turned;
}

}  // namespace slabstream
