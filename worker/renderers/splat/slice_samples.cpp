#include "worker/renderers/splat/slice_samples.h"

#include <algorithm>
#include <cmath>

#include "worker/kernels/segment_set.h"

namespace slabstream {
namespace {

// Planes are moved down by this many voxels. Otherwise a ray that runs within a plane (axis-parallel views have such rays through pixel
// centres) would, by rounding, belong to one side in one slice and to the other in the next, and its samples would be combined out of
// order.
constexpr double kPlaneShift = 0x1p-20;

struct Interval {
  std::int32_t begin, end;
};

// Pixels of [0, count) that belong to voxels [own_begin, own_end) of an axis `size` voxels long, and have a tap in [reach_begin,
// reach_end).
Interval OwnedPixels(const Lattice& lattice, const FootprintTable& footprint, std::int32_t own_begin, std::int32_t own_end,
                     std::int32_t size, std::int32_t reach_begin, std::int32_t reach_end, std::int32_t count) {
  // Whole segments, so that only planes divide segments.
  Interval owned = {FirstPixelWithTap(lattice, reach_begin - footprint.taps + 1, 0, count) / kSegment * kSegment,
                    std::min((FirstPixelWithTap(lattice, reach_end, 0, count) + kSegment - 1) / kSegment * kSegment, count)};
  const auto border = [&](std::int32_t voxel) { return FirstSampleFrom(lattice, footprint.radius, voxel - 0.5 - kPlaneShift, 0, count); };
  if (own_begin > 0) owned.begin = std::max(owned.begin, border(own_begin));
  if (own_end < size) owned.end = std::min(owned.end, border(own_end));
  return owned;
}

}  // namespace

const FootprintTable& Footprints::Get(double sigma) {
  if (last_ != nullptr && sigma == last_sigma_) return *last_;
  // If it varies, rounded to steps of 1.1 %, so that a frame needs only a few dozen.
  constexpr double kSteps = 64;  // an octave
  const double rounded = std::exp2(std::round(kSteps * std::log2(sigma)) / kSteps);
  auto found = tables_.find(rounded);
  if (found == tables_.end()) found = tables_.emplace(rounded, MakeFootprintTable(rounded, kFootprintCut)).first;
  last_sigma_ = sigma;
  last_ = &found->second;
  return *last_;
}

std::int32_t FirstPixelWithTap(const Lattice& lattice, std::int32_t voxel, std::int32_t begin, std::int32_t end) {
  return FirstSamples(lattice, std::int64_t{voxel} << 32, 0).In(begin, end);
}

SliceSamples SampleSlice(const FrameSetup& setup, const Box& box, const Box& reach, std::int32_t k, Footprints& footprints) {
  const auto [c, u, v] = AxesOf(setup.camera.traversal_axis);
  const SheetGrid& grid = setup.sheets;
  const Index3& size = setup.description.geometry.size;
  const SlicePlacement place = PlaceSlice(grid, k);
  const FootprintSigma sigma = FootprintIn(grid, place);
  SliceSamples samples;
  samples.along_u = &footprints.Get(sigma.u);
  samples.along_v = &footprints.Get(sigma.v);
  samples.columns = MakeLattice(place.scale_u, place.offset_u, samples.along_u->radius);
  samples.rows = MakeLattice(place.scale_v, place.offset_v, samples.along_v->radius);
  const Interval columns =
      OwnedPixels(samples.columns, *samples.along_u, box.begin[u], box.end[u], size[u], reach.begin[u], reach.end[u], grid.width);
  const Interval rows =
      OwnedPixels(samples.rows, *samples.along_v, box.begin[v], box.end[v], size[v], reach.begin[v], reach.end[v], grid.height);
  samples.owned = {columns.begin, rows.begin, columns.end, rows.end};
  return samples;
}

}  // namespace slabstream
