// SheetBuffer: the sheet that a slice is splatted into and the image that sheets accumulate in, over one rectangle of the frame, in tiles
// of kTile x kTile pixels. Tiles remember what a slice touched, so that compositing visits nothing else, and which are saturated, so that
// what lies behind them is skipped.
#pragma once

#include <cstdint>
#include <vector>

#include "common/image/local_image.h"
#include "worker/kernels/composite.h"
#include "worker/kernels/cull.h"
#include "worker/kernels/splat.h"
#include "worker/render/splatting/ownership.h"

namespace slabstream {

class SheetBuffer {
 public:
  // Covers `wanted`, grown to whole tiles. A tile whose pixels all transmit at most `termination` is saturated; 0: none ever is. No
  // footprint is wider or higher than `largest_footprint` pixels.
  SheetBuffer(const PixelBounds& wanted, double termination, double largest_footprint);

  // r of composite.h for every pixel, for a perspective camera.
  void SetDistanceRatios(const Camera& camera);

  const PixelBounds& bounds() const { return bounds_; }
  SheetView view() { return {sheet_.data(), bounds_.width(), bounds_.height()}; }

  // `pixels`: of the frame, overlapping bounds(). True if every pixel in it is saturated.
  bool Saturated(const PixelBounds& pixels) const;
  void Touch(const PixelBounds& pixels);

  // For culling voxel by voxel. False where that never hides anything: no termination, or footprints of many tiles, whose blocks and pieces
  // decide.
  bool culls_voxels() const { return culls_voxels_; }
  HiddenTiles hidden_tiles() const { return {hidden_.data(), tiles_x_, tiles_y_}; }

  // Composites and clears the touched tiles.
  void CompositeSlice(const Ownership& ownership);

  // The accumulated image on the smallest rectangle within `frame` that holds everything, and on no pixel where that is nothing.
  LocalImage TakeImage(const PixelBounds& frame);

 private:
  struct TileRange {
    std::int32_t x_begin, y_begin, x_end, y_end;
  };
  TileRange TilesOf(const PixelBounds& pixels) const;
  bool AllSaturated(const TileRange& tiles) const;
  void MarkSaturated(std::int32_t tile_x, std::int32_t tile_y);

  PixelBounds bounds_;
  float saturated_alpha_;
  std::int32_t tiles_x_, tiles_y_;
  std::int32_t reach_tiles_;  // that a footprint extends beyond the tile of its first tap
  bool culls_voxels_;
  std::vector<std::uint8_t> touched_, saturated_, hidden_;  // by tile
  std::int32_t touched_rows_begin_, touched_rows_end_ = 0;  // tile rows
  AlignedVector<float> sheet_, accumulated_, distance_ratio_;
  std::vector<std::int32_t> owned_begin_, owned_end_;  // scratch: by row, relative to a tile
};

}  // namespace slabstream
