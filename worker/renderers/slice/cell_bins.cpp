#include "worker/renderers/slice/cell_bins.h"

#include <fmt/format.h>

#include <utility>

#include "common/parallel/parallel.h"

namespace slabstream::slice {

CellBins::CellBins(const PixelBounds& pixels)
    : pixels_(pixels),
      first_column_(pixels.x_begin / kTileWidth),
      first_row_(pixels.y_begin / kTileHeight),
      columns_(pixels.empty() ? 0 : (pixels.x_end - 1) / kTileWidth + 1 - first_column_),
      rows_(pixels.empty() ? 0 : (pixels.y_end - 1) / kTileHeight + 1 - first_row_),
      first_(std::size_t(tiles()) + 1, 0) {}

Result<CellBins> CellBins::Make(std::span<const PointBounds> points, std::span<const Tetrahedron> tetrahedra,
                                std::span<const std::uint32_t> shown, const PixelBounds& pixels, std::int32_t k_begin, std::int32_t k_end,
                                const std::function<bool(const PixelBounds&)>& skips, std::size_t most_entries) {
  CellBins bins(pixels);
  const auto tiles = std::size_t(bins.tiles());
  if (tiles == 0 || k_begin >= k_end) return bins;
  std::vector<std::uint8_t> skipped(tiles);
  for (std::size_t tile = 0; tile < tiles; ++tile) skipped[tile] = skips(bins.TileAt(std::int32_t(tile))) ? 1 : 0;

  // A counting sort that keeps the order of the cells: blocks of cells count how many they have in each tile, then write them.
  struct Found {
    std::uint32_t cell;
    std::int32_t chunk;
    std::uint16_t column_begin, row_begin, column_end, row_end;
  };
  struct Block {
    std::vector<Found> found;
    std::vector<std::size_t> next;  // by tile: a count, then the place of the next entry
    std::size_t total = 0;          // of the counts
  };
  constexpr std::size_t kLeastCells = 8192, kMostBlocks = 32;
  const std::size_t count = std::clamp<std::size_t>(shown.size() / kLeastCells, 1, kMostBlocks);
  std::vector<Block> blocks(count);
  const auto for_each_tile = [&](const Found& found, auto&& visit) {
    for (std::int32_t row = found.row_begin; row < found.row_end; ++row) {
      for (std::int32_t column = found.column_begin; column < found.column_end; ++column) {
        const std::size_t tile = std::size_t(row) * std::size_t(bins.columns_) + std::size_t(column);
        if (skipped[tile] == 0) visit(tile);
      }
    }
  };
  ParallelFor(0, count, [&](std::size_t number) {
    Block& block = blocks[number];
    block.next.assign(tiles, 0);
    const std::size_t begin = shown.size() * number / count, end = shown.size() * (number + 1) / count;
    block.found.reserve(end - begin);
    for (std::size_t i = begin; i < end && block.total <= most_entries; ++i) {
      SampleBounds at = BoundsOf(points, tetrahedra[shown[i]]);
      const std::int32_t first_k = at.k_begin;
      at = {std::max(at.x_begin, pixels.x_begin), std::max(at.y_begin, pixels.y_begin), std::max(at.k_begin, k_begin),
            std::min(at.x_end, pixels.x_end),     std::min(at.y_end, pixels.y_end),     std::min(at.k_end, k_end)};
      if (at.empty()) continue;
      const Found found = {shown[i],
                           std::max(first_k, 0) / kChunkPlanes,
                           std::uint16_t(at.x_begin / kTileWidth - bins.first_column_),
                           std::uint16_t(at.y_begin / kTileHeight - bins.first_row_),
                           std::uint16_t((at.x_end - 1) / kTileWidth + 1 - bins.first_column_),
                           std::uint16_t((at.y_end - 1) / kTileHeight + 1 - bins.first_row_)};
      block.found.push_back(found);
      for_each_tile(found, [&](std::size_t tile) { ++block.next[tile], ++block.total; });
    }
  });
  std::size_t total = 0;
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    bins.first_[tile] = total;
    for (Block& block : blocks) total += std::exchange(block.next[tile], total);
  }
  if (total > most_entries) {
    return Status::InvalidArgument(
        fmt::format("the grid's cells overlap: {} of them are in more than {} tiles of the picture; request a smaller picture",
                    shown.size(), most_entries));
  }
  bins.first_[tiles] = total;
  bins.entries_.resize(total);
  ParallelFor(0, count, [&](std::size_t number) {
    Block& block = blocks[number];
    for (const Found& found : block.found) {
      for_each_tile(found, [&](std::size_t tile) { bins.entries_[block.next[tile]++] = {found.cell, found.chunk}; });
    }
  });
  return bins;
}

PixelBounds CellBins::TileAt(std::int32_t tile) const {
  const std::int32_t x = (first_column_ + tile % columns_) * kTileWidth, y = (first_row_ + tile / columns_) * kTileHeight;
  return Intersection(pixels_, {x, y, x + kTileWidth, y + kTileHeight});
}

}  // namespace slabstream::slice
