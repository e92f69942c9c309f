// RenderTiles: the frame of an image-order renderer, tile by tile.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "common/base/time.h"
#include "common/image/local_image.h"
#include "common/image/occlusion_mask.h"
#include "common/parallel/parallel.h"
#include "common/stats/report.h"
#include "worker/renderers/for_each_piece.h"

namespace slabstream {

// Calls render(number) for each number of `count` tiles, each a piece (ForEachPiece). Charges the time of all threads to Stage::kSample.
template <class Render>
void ForEachTile(std::int32_t count, const RenderControl& control, RankReport& report, Render&& render) {
  std::atomic<std::int64_t> ns = 0;
  const auto timed = [&](std::int32_t number) {
    const Time begin = MonotonicNow();
    render(number);
    ns += (MonotonicNow() - begin).count();
  };
  ForEachPiece(count, control, timed, ThreadsHere());
  report.stage_ns[std::size_t(Stage::kSample)] += ns;
}

// Calls render(part, its steps, first, floats a row) for parts that together are what `hidden` does not hide of the image, each within
// pixels of one number of steps; `first` is where the part's first pixel is stored. A piece (ForEachPiece) has 2 x 2 tiles of the mask,
// since rays of neighbouring tiles need the same gradients soon after each other.
template <class Render>
void RenderTiles(LocalImage& image, const OcclusionMask& hidden, const RenderControl& control, RankReport& report, Render&& render) {
  constexpr std::int32_t kSide = 2 * kOcclusionTile;
  const PixelBounds& bounds = image.bounds;
  if (bounds.empty()) return;
  const std::int32_t first_x = bounds.x_begin / kSide, first_y = bounds.y_begin / kSide;
  const std::int32_t columns = (bounds.x_end - 1) / kSide + 1 - first_x, rows = (bounds.y_end - 1) / kSide + 1 - first_y;
  const auto width = std::size_t(bounds.width());
  const auto render_part = [&](const PixelBounds& part, std::uint8_t steps) {
    if (steps == kOcclusionSteps) return;
    const std::size_t pixel = std::size_t(part.y_begin - bounds.y_begin) * width + std::size_t(part.x_begin - bounds.x_begin);
    render(part, steps, &image.rgba[4 * pixel], 4 * width);
  };
  ForEachTile(columns * rows, control, report, [&](std::int32_t number) {
    const std::int32_t x = (first_x + number % columns) * kSide, y = (first_y + number / columns) * kSide;
    const PixelBounds piece = Intersection(bounds, {x, y, x + kSide, y + kSide});
    std::array<PixelBounds, 4> tiles;
    std::array<std::uint8_t, 4> steps;
    std::size_t count = 0;
    for (const std::int32_t tile_y : {y, y + kOcclusionTile}) {
      for (const std::int32_t tile_x : {x, x + kOcclusionTile}) {
        const PixelBounds tile = Intersection(piece, {tile_x, tile_y, tile_x + kOcclusionTile, tile_y + kOcclusionTile});
        if (tile.empty()) continue;
        tiles[count] = tile;
        steps[count++] = hidden.StepsAt(tile.x_begin, tile.y_begin);
      }
    }
    // Rays of a packet march together, so a pixel keeps its bits only if packets begin where they do in a tile alone.
    const bool whole = piece.x_begin % kOcclusionTile == 0 && piece.y_begin % kOcclusionTile == 0;
    if (whole && std::all_of(steps.begin(), steps.begin() + count, [&](std::uint8_t of) { return of == steps[0]; })) {
      return render_part(piece, steps[0]);
    }
    for (std::size_t i = 0; i < count; ++i) render_part(tiles[i], steps[i]);
  });
}

}  // namespace slabstream
