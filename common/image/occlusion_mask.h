// OcclusionMask: which parts of a frame are opaque already, or nearly, so that of what lies behind them little or nothing need be rendered.
//
// The display worker makes it from what it has accumulated so far. Workers get it with the groups that lie behind (early termination across
// groups). Another one comes from the volume's bricks alone, before anything is drawn (opaque_front.h). A mask that is out of date or
// missing hides less, so it changes no picture by more than the termination threshold.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/image/pixel_bounds.h"

namespace slabstream {

struct LocalImage;

inline constexpr std::int32_t kOcclusionTile = 8;  // pixels of the rendered frame, along x and y
// All pixels of a tile with n steps transmit at most termination^(n / kOcclusionSteps). With all steps it is hidden.
inline constexpr std::uint8_t kOcclusionSteps = 16;

struct OcclusionMask {
  // Tile (x, y) covers the pixels [8 x, 8 x + 8) x [8 y, 8 y + 8) of the frame, cut at its border. 0 x 0: nothing is known.
  std::int32_t tiles_x = 0, tiles_y = 0;
  std::vector<std::uint8_t> steps;  // [y][x], [0, kOcclusionSteps]; tiles_x * tiles_y of them

  bool empty() const { return steps.empty(); }
  // The steps of the tile that holds a pixel of the frame.
  std::uint8_t StepsAt(std::int32_t x, std::int32_t y) const {
    return empty() ? 0 : steps[std::size_t(y / kOcclusionTile) * std::size_t(tiles_x) + std::size_t(x / kOcclusionTile)];
  }
  // Whether the tile of a pixel, which lies in the frame, is hidden.
  bool Hides(std::int32_t x, std::int32_t y) const { return StepsAt(x, y) == kOcclusionSteps; }
  // Whether all pixels of `bounds`, which lie in the frame, are hidden. True if there are none.
  bool HidesAll(const PixelBounds& bounds) const;
  friend bool operator==(const OcclusionMask&, const OcclusionMask&) = default;
};

// Tiles along an axis of so many pixels.
constexpr std::int32_t OcclusionTiles(std::int32_t pixels) { return (pixels + kOcclusionTile - 1) / kOcclusionTile; }

// What either of two masks of a frame knows.
OcclusionMask Union(const OcclusionMask& a, const OcclusionMask& b);

// Where rays of a box may end: by the steps of their tile, the transmittance of the box alone at which what is in front and the box
// together transmit at most `termination`. 0: never.
class RayEnds {
 public:
  explicit RayEnds(double termination);
  float operator[](std::uint8_t steps) const { return transmittance_[steps]; }

 private:
  std::array<float, kOcclusionSteps + 1> transmittance_{};
};

// All steps for tiles whose pixels all transmit at most `termination`: alpha >= 1 - termination; none for others. Pixels outside the
// image's bounds are empty. `termination` 0, or an image without an opaque tile: an empty mask. `image` is a kRgba image of a frame of
// width x height pixels. `known`: an earlier result, before more was put behind the same image; its hidden tiles stay hidden and are not
// tested again.
OcclusionMask FindHiddenTiles(const LocalImage& image, std::int32_t width, std::int32_t height, double termination,
                              OcclusionMask known = {});

}  // namespace slabstream
