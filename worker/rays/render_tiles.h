// RenderTiles: the frame of an image-order renderer, tile by tile.
#pragma once

#include <atomic>
#include <cstdint>

#include "common/base/time.h"
#include "common/image/local_image.h"
#include "common/image/occlusion_mask.h"
#include "common/stats/report.h"
#include "worker/renderers/for_each_piece.h"

namespace slabstream {

// Calls render(number) for each number of `count` tiles, each a piece (ForEachPiece). Charges the time of all threads to Stage::kSample.
template <class Render>
void ForEachTile(std::int32_t count, const RenderControl& control, RankReport& report, Render&& render) {
  std::atomic<std::int64_t> ns = 0;
  ForEachPiece(count, control, [&](std::int32_t number) {
    const Time begin = MonotonicNow();
    render(number);
    ns += (MonotonicNow() - begin).count();
  });
  report.stage_ns[std::size_t(Stage::kSample)] += ns;
}

// Calls render(tile, its steps, first, floats a row) for the parts of the image's bounds in each tile of the frame that `hidden` does not
// hide, as ForEachTile does; `first` is where the tile's first pixel is stored.
template <class Render>
void RenderTiles(LocalImage& image, const OcclusionMask& hidden, const RenderControl& control, RankReport& report, Render&& render) {
  const PixelBounds& bounds = image.bounds;
  if (bounds.empty()) return;
  const std::int32_t first_x = bounds.x_begin / kOcclusionTile, first_y = bounds.y_begin / kOcclusionTile;
  const std::int32_t columns = (bounds.x_end - 1) / kOcclusionTile + 1 - first_x, rows = (bounds.y_end - 1) / kOcclusionTile + 1 - first_y;
  const auto width = std::size_t(bounds.width());
  ForEachTile(columns * rows, control, report, [&](std::int32_t number) {
    const std::int32_t x = (first_x + number % columns) * kOcclusionTile, y = (first_y + number / columns) * kOcclusionTile;
    const std::uint8_t steps = hidden.StepsAt(x, y);
    if (steps == kOcclusionSteps) return;
    const PixelBounds tile = Intersection(bounds, {x, y, x + kOcclusionTile, y + kOcclusionTile});
    const std::size_t pixel = std::size_t(tile.y_begin - bounds.y_begin) * width + std::size_t(tile.x_begin - bounds.x_begin);
    render(tile, steps, &image.rgba[4 * pixel], 4 * width);
  });
}

}  // namespace slabstream
