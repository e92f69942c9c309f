#include "worker/renderers/splat/occupied_voxels.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "common/base/check.h"
#include "common/parallel/parallel.h"
#include "common/parallel/per_thread.h"
#include "worker/renderers/brick_ranges.h"

namespace slabstream {
namespace {

constexpr std::int32_t kCell = kCellVoxels;

// Occupied voxels found in some slices.
struct Found {
  Index3 begin = {kFar, kFar, kFar}, end;
  std::uint64_t in_box = 0;

  static constexpr std::int32_t kFar = std::numeric_limits<std::int32_t>::max();
  void Include(const Found& other) {
    for (int axis = 0; axis < 3; ++axis) {
      begin[axis] = std::min(begin[axis], other.begin[axis]);
      end[axis] = std::max(end[axis], other.end[axis]);
    }
    in_box += other.in_box;
  }
};

// Bits for voxels [begin, end) of a beam, in the cell that begins at `origin`.
std::uint32_t BitsWithin(std::int32_t origin, std::int32_t begin, std::int32_t end) {
  const std::int32_t first = std::clamp(begin - origin, 0, kCell), last = std::clamp(end - origin, first, kCell);
  return std::uint32_t((std::uint64_t{1} << last) - (std::uint64_t{1} << first));
}

Found FindInSlice(const OccupiedVoxels& cells, const Box& wanted, std::int32_t slice) {
  const auto [c, u, v] = cells.axes;
  Found found;
  for (std::int32_t row = cells.box.begin[v]; row < cells.box.end[v]; ++row) {
    const std::size_t beam = cells.Beam(slice, row);
    if (cells.first_record[beam] == cells.first_record[beam + 1]) continue;
    const bool row_wanted = row >= wanted.begin[v] && row < wanted.end[v];
    for (std::int32_t cell = 0; cell < cells.cell_count; ++cell) {
      const std::uint32_t mask = cells.Masks(beam)[cell];
      if (mask == 0) continue;
      const std::int32_t origin = (cells.first_cell + cell) * kCell;
      found.begin[u] = std::min(found.begin[u], origin + std::countr_zero(mask));
      found.end[u] = std::max(found.end[u], origin + kCell - std::countl_zero(mask));
      if (row_wanted) found.in_box += std::uint64_t(std::popcount(mask & BitsWithin(origin, wanted.begin[u], wanted.end[u])));
    }
    found.begin[v] = std::min(found.begin[v], row);
    found.end[v] = row + 1;
    found.begin[c] = slice;
    found.end[c] = slice + 1;
  }
  return found;
}

}  // namespace

void BrickRecords::Need(const Index3& brick) {
  std::atomic<std::uint8_t>& state = states_[grid_.Number(brick)];
  std::uint8_t met = kNone;
  if (state.compare_exchange_strong(met, kBeingMade, std::memory_order_acquire)) {
    Make(brick);
    state.store(kMade, std::memory_order_release);
    state.notify_all();
    return;
  }
  state.wait(kBeingMade, std::memory_order_acquire);
}

void BrickRecords::NeedAll() {
  ForEachRowOfBricks(grid_, [&](Index3 brick) {
    for (; brick.x < grid_.first.x + grid_.counts.x; ++brick.x) Need(brick);
  });
}

std::size_t VoxelBeams::bytes() const {
  return cells() * sizeof(masks[0]) + (beam_count + 1) * sizeof(first_record[0]) + record_count() * sizeof(VoxelRecord) +
         (to_make == nullptr ? 0 : to_make->bytes());
}

OccupiedVoxels VoxelsOf(const VoxelBeams& beams, Axis traversal, const Box& wanted) {
  OccupiedVoxels cells;
  cells.axes = AxesOf(traversal);
  const auto [c, u, v] = cells.axes;
  CHECK(beams.u == u);
  cells.box = beams.box;
  cells.box.begin[c] = std::max(cells.box.begin[c], wanted.begin[c]);
  cells.box.end[c] = std::min(cells.box.end[c], wanted.end[c]);
  if (cells.box.empty()) {
    cells.box = {};
    return cells;
  }
  cells.first_cell = beams.first_cell;
  cells.cell_count = beams.cell_count;
  cells.slice_stride = beams.Stride(c);
  cells.row_stride = beams.Stride(v);
  cells.first_beam = std::size_t(cells.box.begin[c] - beams.box.begin[c]) * cells.slice_stride;
  cells.masks = beams.masks.get();
  cells.first_record = {beams.first_record.get(), beams.beam_count + 1};
  cells.records = {beams.records.get(), beams.record_count()};
  cells.to_make = beams.to_make.get();

  PerThread<Found> parts;
  ParallelFor(cells.box.begin[c], cells.box.end[c], [&](std::int32_t slice) { parts.Mine().Include(FindInSlice(cells, wanted, slice)); });
  Found found;
  parts.ForEach([&](const Found& part) { found.Include(part); });
  if (found.begin.x != Found::kFar) cells.occupied = {found.begin, found.end};
  cells.occupied_in_box = found.in_box;
  return cells;
}

}  // namespace slabstream
