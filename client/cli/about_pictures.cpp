#include "client/cli/about_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string>
#include <string_view>

#include "common/cli/program.h"
#include "common/view/clip_corners.h"

namespace slabstream {
namespace {

// Where the volume lies, as --clip-box takes it.
std::string ExtentText(const VolumeGeometry& geometry, ClipUnit unit) {
  if (unit == ClipUnit::kPercent) return "0:100,0:100,0:100%";
  if (unit == ClipUnit::kVoxels) return fmt::format("0:{},0:{},0:{}v", geometry.size.x, geometry.size.y, geometry.size.z);
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  Vec3 low = {kInfinite, kInfinite, kInfinite}, high = -low;
  for (const Vec3& corner : CornersOf({}, geometry.bounds())) {
    const Vec3 world = geometry.ToWorld(corner);
    for (const Axis axis : kAxes) {
      low[axis] = std::min(low[axis], world[axis]);
      high[axis] = std::max(high[axis], world[axis]);
    }
  }
  return fmt::format("{:.6g}:{:.6g},{:.6g}:{:.6g},{:.6g}:{:.6g}", low.x, high.x, low.y, high.y, low.z, high.z);
}

bool LeavesSomething(const Clipping& clipping, const VolumeGeometry& geometry) {
  const Result<ClipRegion> region = MakeClipRegion(clipping, geometry);
  return !region.ok() || region->MayKeep(geometry.bounds());
}

// The values that have some opacity, as the curve's points say.
std::string VisibleText(const TransferFunction& transfer) {
  const auto visible = [](const OpacityPoint& point) { return point.opacity > 0; };
  const auto& points = transfer.opacities;
  const auto first = std::ranges::find_if(points, visible);
  if (first == points.end()) return "shows no value at all";
  const auto last = std::find_if(points.rbegin(), points.rend(), visible);
  if (first == points.begin() && last == points.rbegin()) return "shows all values";  // its ends hold outside of them
  if (last == points.rbegin()) return fmt::format("shows values above {:g}", (first - 1)->value);
  if (first == points.begin()) return fmt::format("shows values below {:g}", (last - 1)->value);
  return fmt::format("shows values from {:g} to {:g}", (first - 1)->value, (last - 1)->value);
}

// Colours from `low` to `high` (data values), as `option` says, meet none of the volume's values. Nothing: they do.
std::optional<std::string> RangeWarning(std::string_view option, double low, double high, const ValueRange& values) {
  if (high > double(values.min) && low < double(values.max)) return std::nullopt;
  if (values.min == values.max && low <= double(values.min) && double(values.max) <= high) return std::nullopt;
  return fmt::format("{} shows values from {:g} to {:g}, but those of the volume run from {:g} to {:g}", option, low, high, values.min,
                     values.max);
}

// Why the picture of `frame` is empty. `summary`: of its dataset, under its transfer function.
std::string EmptyWarning(const FrameRequest& frame, const SummaryReply& summary) {
  const VolumeGeometry& geometry = summary.description.geometry;
  if (!LeavesSomething(frame.clipping, geometry)) {
    Clipping without_slab = frame.clipping;
    without_slab.slab.reset();
    const bool slab = LeavesSomething(without_slab, geometry);
    const ClipUnit unit = frame.clipping.box && !slab ? frame.clipping.box->unit : ClipUnit::kWorld;
    return fmt::format("the picture is empty: {} leaves nothing of the volume, which lies in {}",
                       slab                 ? "the plane of --at"
                       : frame.clipping.box ? "--clip-box"
                                            : "--clip-plane",
                       ExtentText(geometry, unit));
  }
  const auto [least, most] = summary.range;
  const bool surfaces = std::ranges::any_of(summary.transfer.isosurfaces, [&](const Isosurface& surface) {
    return surface.value >= double(least) && surface.value <= double(most);
  });
  const std::string run = fmt::format("the volume's values run from {:g} to {:g}", least, most);
  if (!surfaces && MaxOpacity(summary.transfer, double(least), double(most)) == 0) {
    if (least == most) return fmt::format("the picture is empty: all values of the volume are {:g}", least);
    if (!summary.transfer.isosurfaces.empty()) return "the picture is empty: no surface of --isovalue lies in the volume; " + run;
    return fmt::format("the picture is empty: the transfer function {}, but {}", VisibleText(summary.transfer), run);
  }
  return "the picture is empty: nothing that the transfer function shows lies in it; --fit frames what is shown, and " + run;
}

}  // namespace

void WarnOf(Client& client, const FrameRequest& frame, bool empty, const std::optional<ValueWindow>& window) {
  const std::optional<ScalarRange>& range = frame.transfer.scalar_range;
  if (!empty && !window && !range) return;
  const Result<SummaryReply> summary = client.Summarize(SummaryOf(frame));
  if (!summary.ok()) return;
  std::optional<std::string> warning;
  if (window) {
    warning = RangeWarning("--window", window->low(), window->high(), summary->range);
  } else if (range && !range->percentiles) {
    warning = RangeWarning("--scalar-range", range->min, range->max, summary->range);
  }
  if (!warning && empty) warning = EmptyWarning(frame, *summary);
  if (warning) PrintWarning(*warning);
}

}  // namespace slabstream
