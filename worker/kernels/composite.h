// The composite stage: sheets go under what has been accumulated, front to back (over, Porter and Duff 1984), tile by tile.
//
// For a sheet's sum S at a pixel: A = min(S.a, 1), C = S.rgb * A / S.a. Perspective: the ray of the pixel meets sheets r times as far apart
// as the central ray does, so A' = 1 - (1 - A)^r, C' = C A' / A; orthographic: r = 1. Then acc += (1 - acc.a) * (C', A').
#pragma once

#include <cstddef>
#include <cstdint>

namespace slabstream {

inline constexpr int kTile = 8;  // pixels a side

struct TileWork {
  float* sheet = nullptr;                 // RGBA of the tile's upper left pixel; zeroed
  float* accumulated = nullptr;           // likewise; updated
  const float* distance_ratio = nullptr;  // r of the upper left pixel; null: 1 everywhere
  std::ptrdiff_t row_pixels = 0;          // from row to row, of all three
  // Columns of the tile whose samples this box owns, [owned_begin[j], owned_end[j]) of row j, within [0, kTile]; null: all.
  const std::int32_t* owned_begin = nullptr;
  const std::int32_t* owned_end = nullptr;
};

// Composites kTile x kTile pixels and clears the sheet there. Returns the smallest accumulated alpha of the tile.
float CompositeTile(const TileWork& tile);
float CompositeTileReference(const TileWork& tile);

}  // namespace slabstream
