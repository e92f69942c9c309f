// RenderTiles: the frame of an image-order renderer, tile by tile.
#pragma once

#include <tbb/parallel_for.h>

#include <atomic>
#include <cstdint>

#include "common/base/time.h"
#include "common/image/local_image.h"
#include "common/image/occlusion_mask.h"
#include "common/stats/report.h"

namespace slabstream {

// Calls render(number) for each number of `count` tiles, in parallel. Charges the time of all threads to Stage::kSample. Returns early if
// `cancelled`.
template <class Render>
void ForEachTile(std::int32_t count, const std::atomic<bool>& cancelled, RankReport& report, Render&& render) {
  std::atomic<std::int64_t> ns = 0;
  tbb::parallel_for(0, count, [&](std::int32_t number) {
    if (cancelled.load(std::memory_order_relaxed)) return;
    const Time begin = MonotonicNow();
    render(number);
    ns += (MonotonicNow() - begin).count();
  });
  report.stage_ns[std::size_t(Stage::kSample)] += ns;
}

// Calls render(tile, first, floats a row) for the parts of the image's bounds in each tile of the frame that `hidden` does not hide, as
// ForEachTile does; `first` is where the tile's first pixel is stored.
template <class Render>
void RenderTiles(LocalImage& image, const OcclusionMask& hidden, const std::atomic<bool>& cancelled, RankReport& report, Render&& render) {
  const PixelBounds& bounds = image.bounds;
  if (bounds.empty()) return;
  const std::int32_t first_x = bounds.x_begin / kOcclusionTile, first_y = bounds.y_begin / kOcclusionTile;
  const std::int32_t columns = (bounds.x_end - 1) / kOcclusionTile + 1 - first_x, rows = (bounds.y_end - 1) / kOcclusionTile + 1 - first_y;
  const auto width = std::size_t(bounds.width());
  ForEachTile(columns * rows, cancelled, report, [&](std::int32_t number) {
    const std::int32_t x = (first_x + number % columns) * kOcclusionTile, y = (first_y + number / columns) * kOcclusionTile;
    if (hidden.Hides(x, y)) return;
    const PixelBounds tile = Intersection(bounds, {x, y, x + kOcclusionTile, y + kOcclusionTile});
    const std::size_t pixel = std::size_t(tile.y_begin - bounds.y_begin) * width + std::size_t(tile.x_begin - bounds.x_begin);
    render(tile, &image.rgba[4 * pixel], 4 * width);
  });
}

}  // namespace slabstream
