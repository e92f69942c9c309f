#include "coordinator/tuning/box_estimator.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/renderers/renderer_kind.h"

namespace slabstream {
namespace {

double Length(const Camera::ImagePoint& a, const Camera::ImagePoint& b) { return std::hypot(a.x - b.x, a.y - b.y); }

// Pixels of the frame that a voxel in the middle of the volume covers.
double VoxelPixels(const FrameSetup& setup) {
  const Index3& size = setup.description.geometry.size;
  const Vec3 middle = {(size.x - 1) / 2.0, (size.y - 1) / 2.0, (size.z - 1) / 2.0};
  if (!setup.sheets.empty()) {
    const SlicePlacement slice = PlaceSlice(setup.sheets, middle[AxesOf(setup.camera.traversal_axis).c]);
    return setup.renderer->footprint() * slice.scale_u * slice.scale_v;
  }
  // The mean of the areas of its three faces, as the eye sees them.
  const Camera::ImagePoint origin = setup.camera.Project(middle);
  double edges[3] = {};
  for (const Axis axis : kAxes) {
    Vec3 next = middle;
    next[axis] += 1;
    edges[Number(axis)] = Length(setup.camera.Project(next), origin);
  }
  return setup.renderer->footprint() * (edges[0] * edges[1] + edges[1] * edges[2] + edges[2] * edges[0]) / 2;
}

}  // namespace

BoxEstimator::BoxEstimator(const FrameSetup& setup, const VolumeSummary& summary, const OccupancyGrid& occupied, const WorkField* measured,
                           std::int32_t pixel_side)
    : setup_(setup),
      cost_(*setup.renderer, {&occupied, &summary, &setup.transfer, setup.parameters}, measured),
      measured_(measured != nullptr),
      view_(CostViewOf(setup)),
      frame_(FrameBounds(setup)),
      pixel_side_(pixel_side),
      size_(occupied.size),
      voxel_pixels_(VoxelPixels(setup)) {
  CHECK_GE(pixel_side, 1);
  const auto cells = [this](std::int32_t voxels) { return (voxels + side_ - 1) / side_; };
  const auto count = [&] { return std::int64_t{cells(size_.x)} * cells(size_.y) * cells(size_.z); };
  while (count() > kMostCells) side_ *= 2;
  cells_ = {cells(size_.x), cells(size_.y), cells(size_.z)};
  cell_.resize(std::size_t(count()));
  const Index3 fine = OccupancyCells(size_);
  const std::int32_t factor = side_ / kOccupancyCell;
  const CellOccupancy* next = occupied.cells.data();
  for (std::int32_t z = 0; z < fine.z; ++z) {
    for (std::int32_t y = 0; y < fine.y; ++y) {
      double* const row = &cell_[NumberIn(cells_, {0, y / factor, z / factor})];
      for (std::int32_t x = 0; x < fine.x; ++x) row[x / factor] += (next++)->voxels;
    }
  }
}

bool BoxEstimator::IsHidden(const Box& box, const FrameArea& seen) const {
  const OpaqueFront& front = setup_.front;
  if (front.empty()) return false;
  const auto tile = [&front](double begin, double end) { return std::size_t((begin + end) / 2) / std::size_t(front.tile); };
  const std::size_t number = tile(seen.y_begin, seen.y_end) * std::size_t(front.tiles_x) + tile(seen.x_begin, seen.x_end);
  const Axis along = AxesOf(setup_.camera.traversal_axis).c;
  const std::int32_t before = setup_.camera.ascending ? box.begin[along] : size_[along] - box.end[along];  // slices
  return front.StepsAt(front.tiles[number], before) == kOcclusionSteps;
}

BoxEstimator::Estimate BoxEstimator::Of(const Box& box) const {
  const std::int32_t width = (frame_.width() + pixel_side_ - 1) / pixel_side_, height = (frame_.height() + pixel_side_ - 1) / pixel_side_;
  Estimate estimate{0, UniformCoverage({}, 0, width, height)};
  CoverageMap& coverage = estimate.coverage;
  const double tile_side = double(kCoverageTile) * pixel_side_;
  const FrameArea frame{0, 0, double(frame_.x_end), double(frame_.y_end)};
  struct Tile {
    FrameArea reached;
    double hits = 0;  // pixels, each as often as it is hit
  };
  std::vector<Tile> tiles(coverage.share.size());
  double occupied = 0, inside = 0;

  const auto first = [&](Axis axis) { return box.begin[axis] / side_; };
  const auto last = [&](Axis axis) { return (box.end[axis] - 1) / side_; };
  for (std::int32_t z = first(Axis::kZ); z <= last(Axis::kZ); ++z) {
    for (std::int32_t y = first(Axis::kY); y <= last(Axis::kY); ++y) {
      for (std::int32_t x = first(Axis::kX); x <= last(Axis::kX); ++x) {
        const double voxels = cell_[NumberIn(cells_, {x, y, z})];
        if (voxels == 0) continue;
        const Box whole =
            Intersection({{x * side_, y * side_, z * side_}, {(x + 1) * side_, (y + 1) * side_, (z + 1) * side_}}, {{0, 0, 0}, size_});
        const Box part = Intersection(whole, box);
        const double share = double(part.voxel_count()) / double(whole.voxel_count());
        occupied += share * voxels;
        const FrameArea r = ProjectBox(part, setup_, 1, 0);
        const FrameArea seen = Intersection(r, frame);
        if (seen.empty()) continue;
        // Costs that were measured do not have what was hidden.
        const bool hidden = IsHidden(part, seen);
        if (!hidden || measured_) inside += share * voxels * seen.area() / r.area();
        if (hidden) continue;
        const double hits_a_pixel = share * voxels * voxel_pixels_ / r.area();
        const auto tile_of = [&](double pixel, std::int32_t count) { return std::min(std::int32_t(pixel / tile_side), count - 1); };
        for (std::int32_t ty = tile_of(seen.y_begin, coverage.tiles_y); ty <= tile_of(seen.y_end, coverage.tiles_y); ++ty) {
          for (std::int32_t tx = tile_of(seen.x_begin, coverage.tiles_x); tx <= tile_of(seen.x_end, coverage.tiles_x); ++tx) {
            const FrameArea reached = Intersection(seen, {tx * tile_side, ty * tile_side, (tx + 1) * tile_side, (ty + 1) * tile_side});
            if (reached.empty()) continue;
            Tile& tile = tiles[std::size_t(ty) * std::size_t(coverage.tiles_x) + std::size_t(tx)];
            tile.reached.Add(reached);
            tile.hits += hits_a_pixel * reached.area();
          }
        }
      }
    }
  }
  std::size_t number = 0;
  for (std::int32_t ty = 0; ty < coverage.tiles_y; ++ty) {
    for (std::int32_t tx = 0; tx < coverage.tiles_x; ++tx, ++number) {
      const Tile& tile = tiles[number];
      if (tile.hits <= 0) continue;
      const double filled = tile.reached.area() * -std::expm1(-tile.hits / tile.reached.area());
      const double pixels = double(coverage.TilePixels(tx, ty)) * pixel_side_ * pixel_side_;
      coverage.share[number] = float(std::clamp(filled / pixels, 0.0, 1.0));
    }
  }
  // Voxels outside the frame and hidden ones are not drawn.
  if (occupied > 0) estimate.seconds = cost_.Seconds(box, view_) * inside / occupied;
  return estimate;
}

}  // namespace slabstream
