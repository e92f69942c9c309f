#include "common/renderers/splat/splat_cost.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "common/calibration/calibration.h"
#include "common/volume/cells_along.h"

namespace slabstream::splat {
namespace {

constexpr std::int32_t kRim = 2;                 // voxels on either side of a sample that reach it
constexpr std::int32_t kLayer = kOccupancyCell;  // bits from a line of a cell to the one above it
// Mean optical depth of a segment's rays when the last of them is opaque: exp(-6.93) is kDefaultTermination.
constexpr float kOpaqueDepth = calibration::splat::kOpaqueDepth * 6.93F;
constexpr double kMostPixels = 2;  // a voxel, as SheetGrid has it

// tan(elevation) / cos(azimuth), at 20 and 30 degrees: how far a ray rises for each unit across the slices.
constexpr double kRise = 0.42;
// Mean of |tan(azimuth)| between -45 and 45 degrees: how far it goes along the beams.
constexpr float kDrift = 0.44F;

// Rows of samples that lines of a cell reach, or those of the cells below and above it. Row z lies between lines z - 1 and z, and is not
// empty if any of the kRim lines on either side is not.
constexpr LineSet RowsReached(LineSet below, LineSet lines, LineSet above) {
  return lines << 2 * kLayer | lines << kLayer | lines | lines >> kLayer | below >> 6 * kLayer | below >> 7 * kLayer | above << 7 * kLayer;
}

// Optical depth of the rays in a box, by row and by cell along the beams.
class RayDepths {
 public:
  RayDepths(std::int32_t layers, std::int32_t cells, std::int32_t rise)
      : rows_(layers * kOccupancyCell),
        kept_(std::max(rows_ - rise, 0)),
        cells_(cells),
        depth_(std::size_t(rows_) * std::size_t(cells + 1)) {}

  // From one cell across the slices to the next: rays move down, new ones come in at the top, and neighbours mix.
  void Advance() {
    for (std::int32_t cell = 0; cell < cells_; ++cell) {
      float* const depth = Of(cell, 0);
      const float* const from = Of(cell, rows_ - kept_);
      const float* const neighbour = Of(cell + 1, rows_ - kept_);
      for (std::int32_t row = 0; row < kept_; ++row) depth[row] = (1 - kDrift) * from[row] + kDrift * neighbour[row];
      std::fill(depth + kept_, depth + rows_, 0.0F);
    }
  }

  // Rows of a cell in which a segment is not opaque yet.
  LineSet Open(std::int32_t layer, std::int32_t cell) const {
    const float* const depth = Of(cell, layer * kOccupancyCell);
    LineSet open = 0;
    for (std::int32_t z = 0; z < kOccupancyCell; ++z) {
      if (depth[z] < kOpaqueDepth) open |= LinesIn(z, z + 1, 0, kOccupancyCell);
    }
    return open;
  }

  // Rays pass a cell: `rays` are the lines along them that hold anything, `depth` the sum of what these add.
  void Add(std::int32_t layer, std::int32_t cell, LineSet rays, double depth) {
    float* const to = Of(cell, layer * kOccupancyCell);
    const LineSet counts = CountsByLayer(rays);
    const auto of_a_ray = float(depth / (CountOf(rays) * kOccupancyCell));
    for (std::int32_t z = 0; z < kOccupancyCell; ++z) to[z] += of_a_ray * float(counts >> z * kLayer & 0xFF);
  }

 private:
  // A cell after the last one stays empty.
  float* Of(std::int32_t cell, std::int32_t row) { return &depth_[std::size_t(cell) * std::size_t(rows_) + std::size_t(row)]; }
  const float* Of(std::int32_t cell, std::int32_t row) const { return &depth_[std::size_t(cell) * std::size_t(rows_) + std::size_t(row)]; }

  const std::int32_t rows_, kept_, cells_;
  std::vector<float> depth_;  // [cell][row]: mean over a segment
};

}  // namespace

SplatWork::SplatWork(const OccupancyGrid& grid, const Vec3& spacing, double extinction)
    : grid_(grid), spacing_(spacing), extinction_(extinction), least_spacing_(Least(spacing)) {}

double SplatWork::PixelsPerVoxel(Axis axis) const { return std::min(spacing_[axis] / least_spacing_, kMostPixels); }

SplatCounts SplatWork::Count(const Box& box, Axis along) const {
  const Axis beam = along == Axis::kX ? Axis::kY : Axis::kX;
  const CellsAlong slices(box, along), beams(Grown(box, kRim, {{0, 0, 0}, grid_.size}), beam), layers(box, Axis::kZ);
  const Index3 cells = OccupancyCells(grid_.size);
  const auto step = [&](Axis axis) { return axis == Axis::kX ? 1 : axis == Axis::kY ? cells.x : std::ptrdiff_t{cells.x} * cells.y; };
  const auto lines_of = [&](const CellOccupancy& cell) { return beam == Axis::kX ? cell.lines_x : cell.lines_y; };
  const auto rays_of = [&](const CellOccupancy& cell) { return along == Axis::kX ? cell.lines_x : cell.lines_y; };

  const bool can_hide = extinction_ * box.size()[along] >= kOpaqueDepth;  // does any ray become opaque?
  const double rise = kRise * kOccupancyCell * spacing_[along] / spacing_[Axis::kZ];
  RayDepths depths(layers.end - layers.begin, beams.end - beams.begin, std::int32_t(std::lround(std::min(rise, 1e6))));
  SplatCounts counts;
  for (std::int32_t slice = slices.begin; slice < slices.end; ++slice) {
    if (can_hide) depths.Advance();
    LineSet any_layer = 0;
    for (std::int32_t k = layers.begin; k < layers.end; ++k) {
      const CellOccupancy* cell = &grid_.cells[std::size_t(slice * step(along) + beams.begin * step(beam) + k * step(Axis::kZ))];
      const CellOccupancy* below = k > 0 ? cell - step(Axis::kZ) : nullptr;
      const CellOccupancy* above = k + 1 < cells.z ? cell + step(Axis::kZ) : nullptr;
      const LineSet inside = LinesIn(layers.FirstInside(k), layers.EndInside(k), slices.FirstInside(slice), slices.EndInside(slice));
      LineSet any = 0, before = 0;  // rows that any cell reaches, and those that the last one does
      for (std::int32_t i = beams.begin; i < beams.end; ++i) {
        const std::ptrdiff_t at = (i - beams.begin) * step(beam);
        const LineSet lines = lines_of(cell[at]);
        LineSet rows = inside & RowsReached(below != nullptr ? lines_of(below[at]) : 0, lines, above != nullptr ? lines_of(above[at]) : 0);
        if (rows != 0) {
          if (can_hide) rows &= depths.Open(k - layers.begin, i - beams.begin);
          const double share = beams.ShareInside(i);
          counts.segments += share * CountOf(rows);
          counts.octets += share * CountOf(rows & lines);
          counts.runs += CountOf(rows & ~before);
          any |= rows;
          if (can_hide && lines != 0) {
            const double depth = extinction_ * slices.ShareInside(slice) * cell[at].voxels;
            depths.Add(k - layers.begin, i - beams.begin, rays_of(cell[at]), depth);
          }
        }
        before = rows;
      }
      counts.rows += CountOf(any);
      any_layer |= any;
    }
    for (std::int32_t layers_over = kOccupancyCell / 2; layers_over > 0; layers_over /= 2) any_layer |= any_layer >> layers_over * kLayer;
    counts.slices += CountOf(any_layer & LinesIn(0, 1, 0, kOccupancyCell));
  }
  // The counts are of lines, cells long: as many rows as pixels across a line, as many segments as pixels along it.
  const double rows_per_line = PixelsPerVoxel(Axis::kZ), pixels_per_voxel = PixelsPerVoxel(beam);
  counts.rows *= rows_per_line;
  counts.segments *= rows_per_line * pixels_per_voxel;
  counts.runs *= rows_per_line;
  return counts;
}

double MedianExtinction(const TransferFunction& transfer, const VolumeSummary& summary) {
  constexpr double kMostOpacity = 0.999;  // 1 would be infinite
  const ClassificationTable table = Classify(transfer, summary.description, summary.range);
  const auto histogram_bin = [&](std::size_t bin) {
    const double stored = table.stored_origin + double(bin) / table.bin_from_stored_scale;
    return std::size_t(HistogramBin(summary.range, summary.description.mapping.FromStored(stored)));
  };
  std::array<int, kHistogramBins> sharing{};  // bins of the table, by bin of the histogram
  for (std::size_t bin = 0; bin < table.opacity.size(); ++bin) ++sharing[histogram_bin(bin)];
  std::vector<std::pair<double, double>> shown;  // opacity and number of voxels
  double voxels = 0;
  for (std::size_t bin = 0; bin < table.opacity.size(); ++bin) {
    if (table.opacity[bin] <= 0) continue;
    shown.emplace_back(table.opacity[bin], double(summary.histogram[histogram_bin(bin)]) / sharing[histogram_bin(bin)]);
    voxels += shown.back().second;
  }
  std::ranges::sort(shown);
  double below = 0;
  for (const auto& [opacity, count] : shown) {
    below += count;
    if (below >= voxels / 2) return -std::log1p(-std::min(opacity, kMostOpacity)) / table.opacity_distance;
  }
  return 0;
}

AnalyticCost SplatCost(const OccupancyGrid& drawn, const Vec3& spacing, double extinction) {
  return [work = SplatWork(drawn, spacing, extinction)](const Box& box, const CostView& view) {
    const double scale = std::clamp(view.pixels_per_voxel, kMinGridPixelsPerVoxel, kMaxGridPixelsPerVoxel);
    // Counts are for one pixel a voxel. The number of rows and the length of segments both grow with the scale.
    const auto seconds_along = [&](Axis axis) {
      const SplatCounts counts = work.Count(box, axis);
      if (counts.rows == 0) return 0.0;
      namespace cost = calibration::splat;
      return cost::kBox + cost::kSlice * counts.slices +
             scale * (cost::kRow * counts.rows + scale * cost::kSegment * counts.segments + cost::kRun * counts.runs) +
             cost::kOctet * counts.octets;
    };
    if (view.along != Axis::kZ) return seconds_along(view.along);
    return (seconds_along(Axis::kX) + seconds_along(Axis::kY)) / 2;  // lines along z are not known
  };
}

}  // namespace slabstream::splat
