// OpaqueFront: how opaque a volume is at least in front of each place of a frame. It follows from the volume's bricks, the transfer
// function and the view, before anything is drawn (common/planning/least_extinction.h), so a box knows what the boxes in front of it hide
// although all are rendered at the same time.
//
// Distances count slices along the camera's traversal axis: every ray meets them in the same order.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/status.h"
#include "common/image/occlusion_mask.h"
#include "common/view/sheet_grid.h"
#include "common/volume/volume.h"

namespace slabstream {

struct FrameSetup;

struct OpaqueFront {
  static constexpr std::int32_t kMostTiles = 32;  // along an axis
  static constexpr std::uint8_t kNever = 255;     // a value of `depths`
  using Depths = std::array<std::uint8_t, kOcclusionSteps>;

  std::int32_t tile = 0;  // side of a tile in pixels of the frame: FrontTile, or 0: nothing is known
  std::int32_t tiles_x = 0, tiles_y = 0;
  std::int32_t unit = 1;      // slices
  std::vector<Depths> tiles;  // [y][x]: [n]: units from the volume's nearest slice on until n + 1 steps (OcclusionMask) are done

  bool empty() const { return tile == 0; }
  // The steps that are done so many slices behind the volume's nearest one, in a tile of these depths.
  std::uint8_t StepsAt(const Depths& depths, double slices) const {
    return std::uint8_t(
        std::ranges::count_if(depths, [&](std::uint8_t depth) { return depth != kNever && double(depth) * unit <= slices; }));
  }
  friend bool operator==(const OpaqueFront&, const OpaqueFront&) = default;
};

// The rays through a tile of a frame.
class TileBeam {
 public:
  // (u, v) = (u_0 + k u_k, v_0 + k v_k) in slice k; k, u and v as in SheetGrid.
  struct Ray {
    double u_0 = 0, u_k = 0, v_0 = 0, v_k = 0;
  };
  struct Area {
    double u_begin, v_begin, u_end, v_end;
  };
  explicit TileBeam(const std::array<Ray, 4>& corners) : corners_(corners) {}

  const Ray& corner() const { return corners_.front(); }

  // From slice `begin` on, against or along k: the first place at which a ray may be in `area`. Nothing: none will be.
  std::optional<double> FirstIn(const Area& area, double begin, bool ascending) const;

  // A rectangle that holds where all rays meet the slices between j and k.
  Area Between(double j, double k) const;
  // Least physical length of a ray from slice to slice. `axes` and `spacing` of the volume.
  double LeastLength(const SliceAxes& axes, const Vec3& spacing) const;

 private:
  std::array<Ray, 4> corners_;
};

// The beams of tiles of so many pixels a side, [y][x]: of those in `tiles`, which counts in tiles. A tile whose rays do not all meet all
// slices in the camera's order has none.
std::vector<std::optional<TileBeam>> TileBeams(const FrameSetup& setup, std::int32_t tile, const PixelBounds& tiles);

// The side of the tiles of a frame's OpaqueFront: a multiple of two tiles of masks.
std::int32_t FrontTile(const FrameSetup& setup);

// InvalidArgument: a front in a frame that uses no masks, or with other tiles than the frame's.
Status CheckFits(const OpaqueFront& front, const FrameSetup& setup);

// What the setup's front tells of what lies before `box`. Tiles that show nothing of the box have all steps. Empty: nothing is known.
OcclusionMask MaskBefore(const Box& box, const FrameSetup& setup);

}  // namespace slabstream
