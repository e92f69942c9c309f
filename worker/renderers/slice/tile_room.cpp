#include "worker/renderers/slice/tile_room.h"

#include <algorithm>
#include <cmath>

namespace slabstream::slice {

void DeleteTileRoom::operator()(TileRoom* room) const { delete room; }
TileRoomPtr MakeTileRoom() { return TileRoomPtr(new TileRoom); }

bool FindFragments(const SliceWork& work, const PixelBounds& tile, TileRoom& room) {
  room.fragments.clear();
  room.next_fragment = 0;
  if (work.fragments == nullptr) return false;
  std::fill_n(room.ray_ends, kTilePixels, kRayEnd);
  const std::int32_t x0 = tile.x_begin / kTileWidth * kTileWidth, y0 = tile.y_begin / kTileHeight * kTileHeight;
  bool ends = false;
  work.fragments->ForEachIn(tile, [&](std::int32_t x, std::int32_t y, const ShapeFragment& fragment, float at) {
    const std::size_t pixel = std::size_t(y - y0) * kTileWidth + std::size_t(x - x0);
    if (fragment.rgba[3] == 1) {
      room.ray_ends[pixel] = at;
      ends = true;
    } else {
      room.fragments.push_back({std::int32_t(std::ceil(at)), pixel, fragment.rgba});
    }
  });
  std::ranges::stable_sort(room.fragments, {}, &PlaneFragment::plane);
  return ends;
}

void AddFragments(std::int32_t k, TileRoom& room) {
  std::size_t& next = room.next_fragment;
  for (; next < room.fragments.size() && room.fragments[next].plane <= k; ++next) {
    const auto& [plane, pixel, rgba] = room.fragments[next];
    AddBehind(rgba, room.red[pixel], room.green[pixel], room.blue[pixel], room.alpha[pixel]);
  }
}

}  // namespace slabstream::slice
