// What boxes hide in the simulated worlds: a property of box and tile, so that a test knows what is truly hidden without pixels.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "common/planning/frame_occlusion.h"
#include "tests/support/symbolic_images.h"

namespace slabstream {

// One box in four is opaque in a tile.
inline bool IsOpaque(BoxId box, std::int32_t tile_x, std::int32_t tile_y) {
  return (std::uint32_t(tile_x) * 2 + std::uint32_t(tile_y) * 3 + box * 5) % 4 == 0;
}

inline bool AnyOpaque(const std::vector<BoxId>& boxes, std::int32_t tile_x, std::int32_t tile_y) {
  return std::any_of(boxes.begin(), boxes.end(), [&](BoxId box) { return IsOpaque(box, tile_x, tile_y); });
}

// Calls function(x, y, hidden) for each tile.
template <class Function>
void ForEachTile(const OcclusionMask& mask, Function&& function) {
  for (std::int32_t y = 0; y < mask.tiles_y; ++y) {
    for (std::int32_t x = 0; x < mask.tiles_x; ++x) function(x, y, mask.Hides(x * kOcclusionTile, y * kOcclusionTile));
  }
}

// What FindHiddenTiles finds in pixels: tiles in which every pixel shows an opaque box.
inline OcclusionMask FindOpaqueTiles(const SymbolicImage& image, const PixelBounds& frame) {
  OcclusionMask mask;
  mask.tiles_x = OcclusionTiles(frame.width());
  mask.tiles_y = OcclusionTiles(frame.height());
  mask.steps.assign(std::size_t(mask.tiles_x) * std::size_t(mask.tiles_y), kOcclusionSteps);
  for (std::uint64_t i = 0; i < std::uint64_t(frame.pixel_count()); ++i) {
    const std::int32_t x = std::int32_t(i % std::uint64_t(frame.width())) / kOcclusionTile;
    const std::int32_t y = std::int32_t(i / std::uint64_t(frame.width())) / kOcclusionTile;
    const auto pixel = image.find(i);
    if (pixel != image.end() && AnyOpaque(pixel->second, x, y)) continue;
    mask.steps[std::size_t(y) * std::size_t(mask.tiles_x) + std::size_t(x)] = 0;
  }
  if (std::none_of(mask.steps.begin(), mask.steps.end(), [](std::uint8_t steps) { return steps != 0; })) return {};
  return mask;
}

}  // namespace slabstream
