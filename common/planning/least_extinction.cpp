#include "common/planning/least_extinction.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "common/renderers/renderer_kind.h"
#include "common/renderers/sampling_rate.h"

namespace slabstream {
namespace {

// Bricks of larger volumes are not looked at: that would take longer than a frame.
constexpr std::size_t kMostBricks = std::size_t{1} << 22;

// The least of every 2^n bins.
std::vector<std::vector<float>> LeastOfRanges(std::vector<float> values) {
  std::vector<std::vector<float>> levels = {std::move(values)};
  const std::size_t size = levels[0].size();
  for (std::size_t span = 1; 2 * span <= size; span *= 2) {
    std::vector<float> next;
    for (std::size_t i = 0; i + 2 * span <= size; ++i) next.push_back(std::min(levels.back()[i], levels.back()[i + span]));
    levels.push_back(std::move(next));
  }
  return levels;
}

std::vector<float> Extinctions(const ClassificationTable& table) {
  std::vector<float> extinctions;
  for (const float opacity : table.opacity) {
    extinctions.push_back(float(-std::log1p(-std::min(double(opacity), 0.9999)) / table.opacity_distance));
  }
  return extinctions;
}

bool OpacityIsOfValues(const VolumeSummary& summary, const ClassifiedVolume& volume) {
  const TransferFunction& transfer = volume.transfer();
  return volume.renderer()->opacity_by_value() && volume.renderer()->format() == PixelFormat::kRgba && volume.clip().empty() &&
         !summary.description.geometry.rectilinear() && volume.fields().empty() && transfer.gradient_opacities.empty() &&
         transfer.regions.empty() && !summary.stored && summary.cells.empty() && summary.non_finite == 0 &&
         summary.bricks.size() <= kMostBricks;
}

}  // namespace

LeastExtinction FindLeastExtinction(const VolumeSummary& summary, const ClassifiedVolume& volume) {
  if (!OpacityIsOfValues(summary, volume)) return {};
  const ClassificationTable table = volume.renderer()->Table(volume.transfer(), summary.description, summary.range);
  const std::vector<float> extinctions = Extinctions(table);
  if (std::ranges::all_of(extinctions, [](float extinction) { return extinction == 0; })) return {};
  LeastExtinction found{summary.brick_counts, {}, LeastOfRanges(extinctions)};
  const ValueMapping& mapping = summary.description.mapping;
  const auto bin_of = [&](double value) { return table.BinOf(mapping.scale == 0 ? 0 : (value - mapping.offset) / mapping.scale); };
  for (const ValueRange& range : summary.bricks) {
    const auto [low, high] = std::minmax({bin_of(double(range.min)), bin_of(double(range.max))});
    // A bin more on both sides: samples may be interpolated between bins, and found in single precision.
    found.bricks.push_back({std::uint16_t(std::max(low - 1, 0)), std::uint16_t(std::min(high + 1, table.size() - 1))});
  }
  const bool any = std::ranges::any_of(found.bricks, [&](const LeastExtinction::Bins& bins) { return found.Of(bins) > 0; });
  return any ? found : LeastExtinction{};
}

float LeastExtinction::Of(const Bins& bins) const {
  const std::size_t level = std::size_t(std::bit_width(std::size_t(bins.high - bins.low) + 1) - 1);
  return std::min(least[level][bins.low], least[level][std::size_t{bins.high} + 1 - (std::size_t{1} << level)]);
}

namespace {

// How far from it a sample interpolates voxels: as far as footprints reach, or to the next ones.
double ReachOfSamples(const FrameSetup& setup) {
  if (setup.sheets.empty()) return 1;
  double reach = 0;
  for (const double k : {-0.5, setup.description.geometry.size[setup.camera.traversal_axis] - 0.5}) {
    const FootprintSigma sigma = FootprintIn(setup.sheets, PlaceSlice(setup.sheets, k));
    reach = std::max(reach, kFootprintCut * std::max(sigma.u, sigma.v));
  }
  return reach;
}

// Slices in the order of the camera: slice number t is the volume's t-th from the eye.
class BeamMarch {
 public:
  BeamMarch(const LeastExtinction& extinction, const FrameSetup& setup)
      : extinction_(extinction),
        axes_(AxesOf(setup.camera.traversal_axis)),
        size_(setup.description.geometry.size),
        ascending_(setup.camera.ascending),
        reach_(ReachOfSamples(setup)) {}

  std::int32_t slices() const { return size_[axes_.c]; }

  // The least extinction of slices [begin, end) along a beam, 0 if it leaves the volume there.
  float Between(const TileBeam& beam, std::int32_t begin, std::int32_t end) const {
    if (!ascending_) std::tie(begin, end) = std::pair(slices() - end, slices() - begin);
    const TileBeam::Area area = beam.Between(begin - 0.5, end - 0.5);
    const double u_begin = area.u_begin - reach_, u_end = area.u_end + reach_, v_begin = area.v_begin - reach_, v_end = area.v_end + reach_;
    if (u_begin < 0 || v_begin < 0 || u_end > size_[axes_.u] - 1 || v_end > size_[axes_.v] - 1) return 0;
    if (begin < 1 || end > size_[axes_.c] - 1) return 0;
    const std::int32_t last_u = BrickAt(axes_.u, u_end + 1), last_v = BrickAt(axes_.v, v_end + 1), last_c = BrickAt(axes_.c, end);
    const std::int32_t first_u = std::int32_t(u_begin) / kBrick, first_v = std::int32_t(v_begin) / kBrick;
    LeastExtinction::Bins bins{std::numeric_limits<std::uint16_t>::max(), 0};
    for (std::int32_t c = (begin - 1) / kBrick; c <= last_c; ++c) {
      for (std::int32_t v = first_v; v <= last_v; ++v) {
        const LeastExtinction::Bins* brick = &At(first_u, v, c);
        for (std::int32_t u = first_u; u <= last_u; ++u, brick += step_[axes_.u]) {
          bins = {std::min(bins.low, brick->low), std::max(bins.high, brick->high)};
        }
      }
    }
    return extinction_.Of(bins);
  }

  // From slice `begin` on, so many slices in which a ray of the beam lies in a brick of extinction 0, and so the beam's is 0. No more than
  // the ray stays in one brick.
  double EmptyFrom(const TileBeam::Ray& ray, std::int32_t begin) const {
    const double k = ascending_ ? begin : slices() - 1 - begin, step = ascending_ ? 1 : -1;
    const double u = ray.u_0 + k * ray.u_k, v = ray.v_0 + k * ray.v_k;
    const auto outside = [&](Axis axis, double at) { return at < 0 || at > size_[axis] - 1; };
    if (outside(axes_.u, u) || outside(axes_.v, v)) return 1;
    const std::int32_t brick_u = BrickAt(axes_.u, u), brick_v = BrickAt(axes_.v, v), brick_c = BrickAt(axes_.c, k);
    if (extinction_.Of(At(brick_u, brick_v, brick_c)) > 0) return 0;
    const auto left = [](std::int32_t in, double at, double slope) {  // slices until it leaves the brick along this axis
      return slope > 0 ? ((in + 1) * double(kBrick) - at) / slope : slope < 0 ? (in * double(kBrick) - at) / slope : 1e9;
    };
    return std::max(1.0, std::min({left(brick_u, u, step * ray.u_k), left(brick_v, v, step * ray.v_k), left(brick_c, k, step)}));
  }

 private:
  std::int32_t BrickAt(Axis axis, double voxel) const { return std::min(std::int32_t(voxel) / kBrick, extinction_.counts[axis] - 1); }
  const LeastExtinction::Bins& At(std::int32_t u, std::int32_t v, std::int32_t c) const {
    return extinction_.bricks[std::size_t(u * step_[axes_.u] + v * step_[axes_.v] + c * step_[axes_.c])];
  }

  const LeastExtinction& extinction_;
  const Index3 step_{1, extinction_.counts.x, extinction_.counts.x* extinction_.counts.y};  // from brick to brick, in `bricks`
  const SliceAxes axes_;
  const Index3 size_;
  const bool ascending_;
  const double reach_;  // voxels within a slice
};

}  // namespace

OpaqueFront FindOpaqueFront(const LeastExtinction& extinction, const FrameSetup& setup) {
  if (extinction.bricks.empty()) return {};
  // Rounding, and footprints of splatting, whose voxels have rays of their own under perspective.
  constexpr double kSure = 0.97;
  constexpr std::int32_t kStride = 4;  // slices that are looked at together
  static_assert(kBrick % kStride == 0);
  const SliceAxes axes = AxesOf(setup.camera.traversal_axis);
  const Vec3& spacing = setup.description.geometry.spacing;
  const double voxel_length = std::min({spacing.x, spacing.y, spacing.z});
  const std::int32_t slices = setup.description.geometry.size[axes.c];
  // Where rays take samples at a distance, there may be one fewer in a stretch than its length says.
  const double lost = setup.renderer->along_slices() ? 0 : 1 / SamplingRateOf(setup.parameters);
  const BeamMarch march(extinction, setup);
  const PixelBounds frame = FrameBounds(setup);
  OpaqueFront front{.tile = FrontTile(setup)};
  front.tiles_x = (frame.width() - 1) / front.tile + 1;
  front.tiles_y = (frame.height() - 1) / front.tile + 1;
  front.unit = (slices - 1) / (OpaqueFront::kNever - 1) + 1;
  const double a_step = -std::log(setup.termination) / kOcclusionSteps;
  bool any = false;
  for (const std::optional<TileBeam>& beam : TileBeams(setup, front.tile, {0, 0, front.tiles_x, front.tiles_y})) {
    OpaqueFront::Depths& depths = front.tiles.emplace_back();
    depths.fill(OpaqueFront::kNever);
    if (!beam) continue;
    const double sure_length = kSure * beam->LeastLength(axes, spacing) / voxel_length;  // voxel lengths a slice
    double depth = 0;                                                                    // optical
    double owed = lost;                                                                  // voxel lengths of this stretch that do not count
    std::size_t step = 0;
    for (std::int32_t before = 0; before < slices && step < depths.size(); before += kStride) {
      if (const double empty = march.EmptyFrom(beam->corner(), before); empty > 0) {
        owed = lost;
        before += (std::int32_t(std::min(empty, double(slices))) - 1) / kStride * kStride;
        continue;
      }
      const std::int32_t after = std::min(before + kStride, slices);
      const float least = march.Between(*beam, before, after);
      if (!(least > 0)) {
        owed = lost;
        continue;
      }
      const double lengths = (after - before) * sure_length, counted = std::max(0.0, lengths - owed);
      owed = std::max(0.0, owed - lengths);
      depth += counted * double(least);
      // Steps count from the end of the slices in which they are done.
      while (step < depths.size() && depth >= double(step + 1) * a_step) {
        depths[step++] = std::uint8_t(std::min((after + front.unit - 1) / front.unit, OpaqueFront::kNever - 1));
        any = true;
      }
    }
  }
  return any ? front : OpaqueFront{};
}

}  // namespace slabstream
