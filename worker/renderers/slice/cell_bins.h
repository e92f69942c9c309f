// CellBins: for each tile of the picture, the cells that may have samples there, in the order of the planes where they begin.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/base/status.h"
#include "common/image/pixel_bounds.h"
#include "worker/renderers/slice/frame_space.h"

namespace slabstream::slice {

// A tile is kTileWidth x kTileHeight pixels of the frame; a chunk is kChunkPlanes planes. Both are counted from pixel (0, 0) and plane 0,
// for any box, so that samples have the same bits in every box.
inline constexpr std::int32_t kTileWidth = 64, kTileHeight = 16, kChunkPlanes = 8;

// Whole numbers x, y and k of the samples that a cell may have; begin >= end: none.
struct SampleBounds {
  std::int32_t x_begin, y_begin, k_begin, x_end, y_end, k_end;

  bool empty() const { return x_begin >= x_end || y_begin >= y_end || k_begin >= k_end; }
};
inline SampleBounds BoundsOf(std::span<const PointBounds> points, const Tetrahedron& cell) {
  PointBounds hull = points[cell[0]];
  for (std::size_t p = 1; p < 4; ++p) {
    const PointBounds& point = points[cell[p]];
    for (std::size_t i = 0; i < 4; ++i) hull.begin[i] = std::min(hull.begin[i], point.begin[i]);
    for (std::size_t i = 0; i < 4; ++i) hull.end[i] = std::max(hull.end[i], point.end[i]);
  }
  if (hull.end[3] > 0) return {};
  const auto whole = [](float value) { return std::int32_t(value); };
  return {whole(hull.begin[0]), whole(hull.begin[1]), whole(hull.begin[2]), whole(hull.end[0]), whole(hull.end[1]), whole(hull.end[2])};
}

class CellBins {
 public:
  struct Entry {
    std::uint32_t cell;
    std::int32_t chunk;  // where the cell begins
  };
  static constexpr std::size_t kMostEntries = std::size_t{1} << 28;

  // `shown`: numbers of tetrahedra. Only cells with samples in `pixels` and [k_begin, k_end) count; `skips(tile)` leaves out a tile.
  // InvalidArgument: they are in more than `most_entries` tiles, all together; in a grid that fills space once, ten million cells are in
  // far fewer. Parallel.
  static Result<CellBins> Make(std::span<const PointBounds> points, std::span<const Tetrahedron> tetrahedra,
                               std::span<const std::uint32_t> shown, const PixelBounds& pixels, std::int32_t k_begin, std::int32_t k_end,
                               const std::function<bool(const PixelBounds&)>& skips, std::size_t most_entries = kMostEntries);

  std::int32_t tiles() const { return columns_ * rows_; }
  // The part of a tile that lies in `pixels`.
  PixelBounds TileAt(std::int32_t tile) const;
  // Its cells, in ascending order.
  std::span<const Entry> VoxelsOf(std::int32_t tile) const {
    return std::span(entries_).subspan(first_[std::size_t(tile)], first_[std::size_t(tile) + 1] - first_[std::size_t(tile)]);
  }

 private:
  explicit CellBins(const PixelBounds& pixels);

  PixelBounds pixels_;
  std::int32_t first_column_, first_row_, columns_, rows_;  // tiles
  std::vector<std::size_t> first_;                          // where each tile's cells begin in entries_, and where the last one's end
  std::vector<Entry> entries_;
};

}  // namespace slabstream::slice
