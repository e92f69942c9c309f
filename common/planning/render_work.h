// RenderWork: what rendering a box costs, foretold from what is occupied. Boxes are cut by it before any of them has been rendered.
//
// It is no sum over voxels, which is why boxes are asked about, not cells:
//
//   splatting  kSplatBox for a box, kSlice for each of its slices, kRow for each row of samples that anything reaches in a slice, kSegment
//              for each of its segments that holds anything, kRun for each stretch of such segments, kOctet for each octet of voxels that
//              is shaded (SplatWork counts them). Boxes that are long across the slices are dear, and so are boxes that lie thin between
//              rims. What is hidden within the box costs nothing.
//   Z-buffer   kSurfaceCell for each cell through which a surface passes, kPixel for each pixel of the image, kZBufferBox for a box.
//
// Views turn about z, so slices are crossed along x or along y. Constants are nanoseconds of one thread at about a pixel a voxel; only
// their ratios matter.
//
// Splatting was fitted to kd-trees (as thin as now and thicker) and beams of 8 and 16 boxes, by voxels and by what is occupied, over class
// I, vessels, heptane, bonsai and MR brain in views along x and y. Root mean square of the relative difference over 16 boxes, in brackets
// when fitted to the other four volumes: class I 0.05 (0.05), vessels 0.05 (0.06), heptane 0.05 (0.05), bonsai 0.11 (0.12), whose pot is
// denser than its median voxel, MR brain 0.07 (0.07). The Z-buffer was fitted to boxes of vessels (0.19) and heptane (0.27).
// bench/balance_bench tells it for any volume ("foretold to").
#pragma once

#include <array>
#include <cstdint>

#include "common/classification/classification_table.h"
#include "common/planning/frame_request.h"
#include "common/planning/splat_work.h"
#include "common/volume/occupancy_grid.h"
#include "common/volume/summary.h"

namespace slabstream {

// The table that CountOccupied needs for boxes of this renderer: of what it draws. (The Z-buffer draws voxels with at least half of the
// largest opacity.)
ClassificationTable DrawnTable(const TransferFunction& transfer, const VolumeSummary& summary, RendererKind renderer);

// A voxel length, of the voxels that show anything, by the summary's histogram; finite, >= 0. The median: a mean is that of the few dense
// voxels of what is thin otherwise.
double MedianExtinction(const TransferFunction& transfer, const VolumeSummary& summary);

class RenderWork {
 public:
  // `grid`, of what the renderer draws, must outlive this. `spacing` > 0 is the volume's. `extinction` as MedianExtinction tells it; the
  // Z-buffer needs none.
  RenderWork(const OccupancyGrid& grid, const Vec3& spacing, RendererKind renderer, double extinction)
      : grid_(grid), renderer_(renderer), splatting_(grid, spacing, extinction) {}

  // Nanoseconds, seen along x and seen along y. `box` lies inside the volume. 0 where nothing
  // occupied reaches any sample of it.
  using ByView = std::array<double, 2>;
  ByView Of(const Box& box) const;

 private:
  static constexpr double kSplatBox = 39e3, kSlice = 1000, kRow = 49, kSegment = 7.5, kRun = 16, kOctet = 18;
  static constexpr double kSurfaceCell = 230, kPixel = 1.5, kZBufferBox = 1.5e3;

  ByView SplattingOf(const Box& box) const;
  ByView ZBufferOf(const Box& box) const;

  const OccupancyGrid& grid_;
  const RendererKind renderer_;
  const SplatWork splatting_;
};

}  // namespace slabstream
