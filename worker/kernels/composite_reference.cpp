#include <algorithm>
#include <cmath>

#include "worker/kernels/composite.h"

namespace slabstream {

float CompositeTileReference(const TileWork& tile) {
  float least = 1;
  for (int j = 0; j < kTile; ++j) {
    for (int i = 0; i < kTile; ++i) {
      const std::ptrdiff_t pixel = j * tile.row_pixels + i;
      float* sheet = tile.sheet + 4 * pixel;
      float* accumulated = tile.accumulated + 4 * pixel;
      const bool owned = tile.owned_begin == nullptr || (i >= tile.owned_begin[j] && i < tile.owned_end[j]);
      if (owned && sheet[3] > 0) {
        const float alpha = std::min(sheet[3], 1.0F);
        const float corrected = tile.distance_ratio == nullptr ? alpha : 1 - std::pow(1 - alpha, tile.distance_ratio[pixel]);
        const float weight = (1 - accumulated[3]) * (corrected / sheet[3]);
        for (int c = 0; c < 3; ++c) accumulated[c] += weight * sheet[c];
        accumulated[3] += (1 - accumulated[3]) * corrected;
      }
      std::fill_n(sheet, 4, 0.0F);
      least = std::min(least, accumulated[3]);
    }
  }
  return least;
}

}  // namespace slabstream
