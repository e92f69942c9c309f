// RenderWork: what rendering a box costs, foretold from what is occupied. Boxes are cut by it before any of them has been rendered.
//
// It is no sum over voxels, which is why boxes are asked about, not cells:
//
//   splatting  kRow for each row of samples that anything reaches in each slice, kOctet for each octet (8 voxels of a beam) that holds
//              anything, kSplatBox for a box. A row costs what it costs however long it is, so boxes that are long across the slices are
//              dear, and so are boxes that lie thin between rims (rows reach kRim voxels beyond the box). What lies behind an optical depth
//              of kOpaqueDepth within the box is hidden and costs nothing.
//   Z-buffer   kSurfaceCell for each cell through which a surface passes, kPixel for each pixel of the image, kZBufferBox for a box.
//
// Views turn about z, so slices are crossed along x or along y, from either end; the mean of both ends counts. Constants are nanoseconds of
// one thread at about a pixel a voxel; only their ratios matter. Rows are known by cells: of a column of cells along a beam, the share of
// beams that hold anything is 1 - prod(1 - rows / 64), as if rows lay independently, and that of rows that anything reaches
// 1 - prod(1 - rows / 64)^2, between beams side by side and beams that lie alone. Likewise a cell stops the share rows / 64 of the rays, as
// far as its voxels on them reach kOpaqueDepth at the median extinction.
//
// Splatting was fitted to kd-trees of 16 and 48 boxes over class I, vessels, heptane, bonsai and MR brain in views along x and y. Root mean
// square of the relative difference over 16 boxes, in brackets when fitted to the other four volumes: class I 0.12 (0.12), vessels 0.13
// (0.14), heptane 0.05 (0.06), bonsai 0.13 (0.13), MR brain 0.11 (0.12). The Z-buffer was fitted to boxes of vessels (0.19) and heptane
// (0.27). bench/balance_bench tells it for any volume ("foretold to").
#pragma once

#include <array>
#include <cstdint>

#include "common/classification/classification_table.h"
#include "common/planning/frame_request.h"
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
  // `grid`, of what the renderer draws, must outlive this. `extinction` as MedianExtinction tells it; the Z-buffer needs none.
  RenderWork(const OccupancyGrid& grid, RendererKind renderer, double extinction)
      : grid_(grid), renderer_(renderer), extinction_(extinction) {}

  // Nanoseconds, seen along x and seen along y. `box` lies inside the volume. 0 if nothing is occupied in it and within kRim of it.
  using ByView = std::array<double, 2>;
  ByView Of(const Box& box) const;

 private:
  static constexpr std::int32_t kRim = 2;       // voxels
  static constexpr double kOpaqueDepth = 6.93;  // exp(-6.93) is kDefaultTermination
  static constexpr double kRow = 110, kOctet = 15, kSplatBox = 165e3;
  static constexpr double kSurfaceCell = 230, kPixel = 1.5, kZBufferBox = 1.5e3;

  struct Seen {
    double rows = 0, octets = 0;
  };
  Seen See(const Box& box, Axis along, bool ascending) const;
  ByView SplattingOf(const Box& box) const;
  ByView ZBufferOf(const Box& box) const;

  const OccupancyGrid& grid_;
  const RendererKind renderer_;
  const double extinction_;
};

}  // namespace slabstream
