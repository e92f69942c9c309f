#include "coordinator/probe/pick.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "common/frame/label_look.h"
#include "common/frame/smooth_label.h"
#include "common/renderers/renderer_kind.h"
#include "coordinator/probe/met_shapes.h"

namespace slabstream {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kStep = 0.25;  // least distances of voxels
constexpr int kParts = 64;      // of the step in which the point lies

// Depths [begin, end] of a ray.
struct DepthRange {
  double begin, end;
};

// What clipping leaves of the ray in the volume, nearest first.
std::vector<DepthRange> DrawnRanges(const FrameSetup& setup, const Camera::Ray& ray) {
  DepthRange whole = {0, kInfinity};
  const auto cut = [&ray](DepthRange& range, const Vec3& normal, double offset) {  // keeps Dot(normal, p) + offset >= 0
    const double at_origin = Dot(normal, ray.origin) + offset, slope = Dot(normal, ray.direction);
    if (slope > 0) {
      range.begin = std::max(range.begin, -at_origin / slope);
    } else if (slope < 0) {
      range.end = std::min(range.end, -at_origin / slope);
    } else if (at_origin < 0) {
      range.end = -kInfinity;
    }
  };
  for (const Axis axis : kAxes) {
    Vec3 normal;
    normal[axis] = 1;
    cut(whole, normal, 0.5);
    cut(whole, -normal, setup.description.geometry.size[axis] - 0.5);
  }
  if (whole.begin >= whole.end) return {};
  if (setup.clip.empty()) return {whole};
  DepthRange region = whole;
  for (const HalfSpace& side : setup.clip.sides) cut(region, side.normal, side.offset);
  if (setup.clip.mode == ClipMode::kKeep) return region.begin < region.end ? std::vector{region} : std::vector<DepthRange>{};
  if (region.begin >= region.end) return {whole};
  std::vector<DepthRange> rest;
  if (whole.begin < region.begin) rest.push_back({whole.begin, region.begin});
  if (region.end < whole.end) rest.push_back({region.end, whole.end});
  return rest;
}

// Where a ray enters a voxel.
struct Entry {
  double depth;
  Index3 voxel;
};

// The ray through opaque cells of voxels, [v - 0.5, v + 0.5) (J. Amanatides, A. Woo: A fast voxel traversal algorithm, 1987).
std::optional<Entry> FirstOpaqueVoxel(const FrameSetup& setup, const ProbeVolume& volume, const Camera::Ray& ray,
                                      const std::vector<DepthRange>& ranges) {
  const ClassificationTable table = setup.renderer->Table(setup.transfer, setup.description, setup.range);
  const FieldSetup* const labels = LabelsOf(setup);
  const auto is_opaque = [&](const Index3& voxel) {
    const LabelUse use =
        labels == nullptr ? LabelUse::kAsVolume : UseOf(labels->labels->mode, StyleOf(*labels->labels, volume.label(voxel)));
    if (use != LabelUse::kAsVolume) return use == LabelUse::kOpaque;
    const double stored = volume.StoredAt(voxel);
    return std::isfinite(stored) && table.opacity[std::size_t(table.BinOf(stored))] > 0;
  };
  const Box bounds = setup.description.geometry.bounds();
  for (const DepthRange& range : ranges) {
    double depth = range.begin;
    Index3 voxel = Max(bounds.begin, Min(VoxelAt(ray.origin + depth * ray.direction), bounds.end - Uniform(1)));
    while (bounds.Contains(voxel) && depth < range.end) {
      if (is_opaque(voxel)) return Entry{depth, voxel};
      double next = kInfinity;
      int axis = 0;
      for (int i = 0; i < 3; ++i) {
        if (ray.direction[i] == 0) continue;
        const double border = voxel[i] + (ray.direction[i] > 0 ? 0.5 : -0.5);
        const double at = (border - ray.origin[i]) / ray.direction[i];
        if (at < next) {
          next = at;
          axis = i;
        }
      }
      depth = std::max(depth, next);
      voxel[axis] += ray.direction[axis] > 0 ? 1 : -1;
    }
  }
  return std::nullopt;
}

// visit(depth, data value) at the samples of the ray, nearest first. Values may not be finite.
void VisitSamples(const FrameSetup& setup, const ProbeVolume& volume, const Camera::Ray& ray, const std::vector<DepthRange>& ranges,
                  double step, auto&& visit) {
  for (const DepthRange& range : ranges) {
    const auto count = std::int64_t(std::ceil((range.end - range.begin) / step));
    for (std::int64_t i = 0; i <= count; ++i) {
      const double depth = std::min(range.begin + double(i) * step, range.end);
      const Vec3 voxel = setup.description.geometry.stretch.ToVoxel(ray.origin + depth * ray.direction);
      visit(depth, setup.description.mapping.FromStored(volume.Interpolated(voxel)));
    }
  }
}

// What a projection of the volume shows.
struct Projected {
  std::optional<double> depth = {};  // of the nearest sample with the value; none: there is no such sample
  double opacity = 0;                // of the pixel
};

Projected Project(const FrameSetup& setup, PickRule rule, const ProbeVolume& volume, const Camera::Ray& ray,
                  const std::vector<DepthRange>& ranges, double step) {
  Projected found;
  const auto show = [&](double value) { found.opacity = 1 - std::pow(1 - setup.transfer.Opacity(value), setup.weight); };
  if (rule == PickRule::kNone) {
    found.opacity = ranges.empty() ? 0 : 1;
  } else if (rule == PickRule::kMean) {
    double sum = 0, count = 0;
    VisitSamples(setup, volume, ray, ranges, step, [&](double /*depth*/, double value) {
      if (!std::isfinite(value)) return;
      sum += value;
      ++count;
    });
    if (count > 0) show(sum / count);
  } else {
    const double sign = rule == PickRule::kLargest ? 1 : -1;
    double best = -kInfinity;
    VisitSamples(setup, volume, ray, ranges, step, [&](double depth, double value) {
      if (!(sign * value > best)) return;  // also not finite
      best = sign * value;
      found.depth = depth;
    });
    if (found.depth) show(sign * best);
  }
  return found;
}

constexpr double kHalf = 0.5;  // of the light

// The shape nearer than `depth` at which half of the light is lost, of which `left` reaches the shapes; null: none.
const MetShape* ShapeThatHides(const std::vector<MetShape>& met, double left, double depth) {
  for (const MetShape& shape : met) {
    if (!(shape.depth < depth)) break;
    left *= 1 - shape.opacity;
    if (left <= kHalf) return &shape;
  }
  return nullptr;
}

// How a ray loses light.
class Matter {
 public:
  Matter(const FrameSetup& setup, const ProbeVolume& volume)
      : setup_(setup), volume_(volume), table_(setup.renderer->Table(setup.transfer, setup.description, setup.range)) {
    const Vec3& spacing = setup.description.geometry.spacing;
    for (int i = 0; i < 3; ++i) per_world_[i] = 1 / spacing[i];
    if (!setup.renderer->Can(Ability::kIsosurfaces)) return;
    for (const Isosurface& surface : setup.transfer.isosurfaces) {
      surfaces_.push_back({double(StoredIsovalue(surface.value, setup.description.mapping)), surface.opacity});
    }
  }

  struct Surface {
    double stored, opacity;
  };
  const std::vector<Surface>& surfaces() const { return surfaces_; }
  double StoredAt(const Vec3& p) const { return volume_.Interpolated(stretch().ToVoxel(p)); }

  // Of a least spacing at p, where the interpolated sample is `stored`; infinite: opaque.
  double Extinction(const Vec3& p, double stored) const {
    double factor = 1;
    if (const FieldSetup* const labels = LabelsOf(setup_)) {
      const double opacity = LabelOpacityAt(p, *labels->labels);
      if (opacity >= 0 && labels->labels->mode == LabelMode::kSurface) return -std::log1p(-opacity);
      if (opacity >= 0) factor = opacity;
    }
    if (!std::isfinite(stored)) return 0;
    double opacity = factor * double(table_.opacity[std::size_t(table_.BinOf(stored))]);
    if (opacity > 0 && !setup_.transfer.regions.empty()) {
      opacity = factor * LookAt(setup_.transfer.regions, setup_.description.mapping.FromStored(stored), Slope(p)).opacity;
    }
    if (opacity > 0 && !setup_.transfer.gradient_opacities.empty() && setup_.renderer->Can(Ability::kGradientOpacity)) {
      opacity *= GradientOpacity(setup_.transfer.gradient_opacities, Slope(p));
    }
    return -std::log1p(-opacity) / table_.opacity_distance;
  }

 private:
  // LabelledVoxel::opacity at p, of labels on the volume's voxels.
  double LabelOpacityAt(const Vec3& p, const LabelLook& look) const {
    const auto at = [&](const Index3& voxel) {
      const Box bounds = setup_.description.geometry.bounds();
      const std::uint64_t label = volume_.label(Max(bounds.begin, Min(voxel, bounds.end - Uniform(1))));
      const LabelStyle style = StyleOf(look, label);
      return LabelledVoxel{label, style.shown ? double(style.opacity) : -1};
    };
    if (!look.smooth) return at(VoxelAt(p)).opacity;
    const Index3 floor = VoxelAt(p - Vec3{0.5, 0.5, 0.5});
    std::array<LabelledVoxel, 64> around;
    for (std::int32_t i = 0; i < 64; ++i) around.at(std::size_t(i)) = at(floor + Index3{i % 4 - 1, i / 4 % 4 - 1, i / 16 - 1});
    return SmoothLabel(around, p - ToVec3(floor)).opacity;
  }

  const Stretch& stretch() const { return setup_.description.geometry.stretch; }

  // Data values per unit of the world.
  double Slope(const Vec3& p) const {
    const Vec3 voxel = stretch().ToVoxel(p);
    Vec3 gradient;
    for (int i = 0; i < 3; ++i) {
      Vec3 offset;
      offset[i] = 1;
      const Axis axis = kAxes[std::size_t(i)];
      const double length = stretch().ToData(voxel[i] + 1, axis) - stretch().ToData(voxel[i] - 1, axis);
      gradient[i] = (volume_.Interpolated(voxel + offset) - volume_.Interpolated(voxel - offset)) / length * per_world_[i];
    }
    const double slope = Length(gradient) * std::abs(setup_.description.mapping.scale);
    return std::isfinite(slope) ? slope : 0;
  }

  const FrameSetup& setup_;
  const ProbeVolume& volume_;
  const ClassificationTable table_;
  Vec3 per_world_;
  std::vector<Surface> surfaces_;
};

// Follows a ray front to back until half of its light is lost.
class HalfLightWalk {
 public:
  HalfLightWalk(const Matter& matter, const Camera::Ray& ray, double least_per_depth)
      : matter_(matter), ray_(ray), least_per_depth_(least_per_depth) {}

  // Whether half is lost there.
  bool Meets(const MetShape& shape) {
    left_ *= 1 - shape.opacity;
    return left_ <= kHalf;
  }

  std::optional<double> Along(const DepthRange& range, double step) {
    const auto count = std::int64_t(std::ceil((range.end - range.begin) / step));
    double stored = StoredAt(range.begin);
    for (std::int64_t i = 0; i < count; ++i) {
      const DepthRange part = {range.begin + double(i) * step, std::min(range.begin + double(i + 1) * step, range.end)};
      const double before = left_, first = stored;
      Pass(part, stored);
      if (left_ > kHalf) continue;
      // Again, in small steps.
      left_ = before;
      stored = first;
      for (int k = 0; k < kParts; ++k) {
        const double width = (part.end - part.begin) / kParts;
        const DepthRange small = {part.begin + k * width, part.begin + (k + 1) * width};
        Pass(small, stored);
        if (left_ <= kHalf) return 0.5 * (small.begin + small.end);
      }
      left_ = std::max(left_, kHalf);  // the small steps lost a little less: go on
    }
    return std::nullopt;
  }

 private:
  double StoredAt(double depth) const { return matter_.StoredAt(ray_.origin + depth * ray_.direction); }

  // `stored`: the sample at its begin, then that at its end.
  void Pass(const DepthRange& part, double& stored) {
    const double middle = 0.5 * (part.begin + part.end), next = StoredAt(part.end);
    const Vec3 p = ray_.origin + middle * ray_.direction;
    left_ *= std::exp(-matter_.Extinction(p, StoredAt(middle)) * (part.end - part.begin) * least_per_depth_);
    for (const Matter::Surface& surface : matter_.surfaces()) {
      if ((stored >= surface.stored) != (next >= surface.stored)) left_ *= 1 - surface.opacity;
    }
    stored = next;
  }

  const Matter& matter_;
  const Camera::Ray& ray_;
  const double least_per_depth_;
  double left_ = 1;  // transmittance
};

}  // namespace

std::optional<Picked> Pick(const FrameSetup& setup, const ProbeVolume& volume, double x, double y, std::span<const ShapeView> shapes) {
  const Camera::Ray ray = setup.camera.RayAt(x * setup.camera.supersample, y * setup.camera.supersample);
  const std::vector<MetShape> met = MeetShapes(setup, shapes, ray);
  std::vector<DepthRange> ranges = DrawnRanges(setup, ray);
  if (!met.empty() && met.back().opacity == 1) {
    for (DepthRange& range : ranges) range.end = std::min(range.end, met.back().depth);
    std::erase_if(ranges, [](const DepthRange& range) { return range.begin >= range.end; });
  }
  const Vec3& spacing = setup.description.geometry.spacing;
  const double length_per_depth = Length(ray.direction * spacing), least_per_depth = length_per_depth / Least(spacing);
  const double step = kStep * setup.description.geometry.least_distance() / length_per_depth;

  const auto voxel_at = [&](double depth) {
    return VoxelAt(setup.description.geometry.stretch.ToVoxel(ray.origin + depth * ray.direction));
  };
  const auto picked = [&](double depth, double deeper) {
    const Box bounds = setup.description.geometry.bounds();
    return Picked{ray.origin + depth * ray.direction, depth, Max(bounds.begin, Min(voxel_at(depth + deeper), bounds.end - Uniform(1)))};
  };
  const auto picked_shape = [&](const MetShape& shape) {
    return Picked{ray.origin + shape.depth * ray.direction, shape.depth, voxel_at(shape.depth), shape.shape, shape.value};
  };
  const PickRule rule = setup.renderer->PickRuleOf(setup.parameters);
  if (rule == PickRule::kHalfOpacity) {
    const Matter matter(setup, volume);
    HalfLightWalk walk(matter, ray, least_per_depth);
    auto next = met.begin();
    for (DepthRange rest : ranges) {
      for (; next != met.end() && next->depth < rest.end; ++next) {
        if (next->depth > rest.begin) {
          if (const std::optional<double> depth = walk.Along({rest.begin, next->depth}, step)) return picked(*depth, step / kStep);
          rest.begin = next->depth;
        }
        if (walk.Meets(*next)) return picked_shape(*next);
      }
      if (const std::optional<double> depth = walk.Along(rest, step)) return picked(*depth, step / kStep);
    }
    for (; next != met.end(); ++next) {
      if (walk.Meets(*next)) return picked_shape(*next);
    }
    return std::nullopt;
  }
  if (rule == PickRule::kSurface) {
    const std::optional<Entry> entry = FirstOpaqueVoxel(setup, volume, ray, ranges);
    if (const MetShape* const shape = ShapeThatHides(met, 1, entry ? entry->depth : kInfinity)) return picked_shape(*shape);
    if (!entry) return std::nullopt;
    return Picked{ray.origin + entry->depth * ray.direction, entry->depth, entry->voxel};
  }
  const Projected seen = Project(setup, rule, volume, ray, ranges, step);
  if (1 - seen.opacity > kHalf) {
    if (const MetShape* const shape = ShapeThatHides(met, 1 - seen.opacity, kInfinity)) return picked_shape(*shape);
  }
  return seen.depth ? std::optional(picked(*seen.depth, 0)) : std::nullopt;
}

}  // namespace slabstream
