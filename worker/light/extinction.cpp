#include "worker/light/extinction.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/classification/region_table.h"
#include "common/renderers/renderer_kind.h"

namespace slabstream {
namespace {

constexpr double kMostOpacity = 0.999;  // of a voxel length, or of a surface: more is not seen in a shadow

double ExtinctionOfOpacity(double opacity, double opacity_distance) {
  const double of_length = -std::log1p(-std::min(opacity, 1 - 1e-12)) / opacity_distance;
  return std::min(of_length, -std::log1p(-kMostOpacity));
}

// The extinction of stored samples, and its mean over ranges of them. Between two bins of the classification table it is linear; it is
// looked up at several places from bin to bin.
class ValueExtinction {
 public:
  // The extinction of a voxel length times `per_voxel_length`.
  ValueExtinction(const ClassificationTable& table, double per_voxel_length) {
    constexpr int kPlaces = 8192;
    const int fine = std::max(2, kPlaces / table.size());  // even: halfway between two stored integers lies a place
    scale_ = float(table.bin_from_stored_scale * fine);
    offset_ = float(0.5 - table.stored_origin * table.bin_from_stored_scale * fine);
    std::vector<double> bins;
    for (const float opacity : table.opacity) {
      bins.push_back(ExtinctionOfOpacity(double(opacity), table.opacity_distance) * per_voxel_length);
    }
    const auto last = (bins.size() - 1) * std::size_t(fine);
    last_ = float(last);
    for (std::size_t place = 0; place <= last; ++place) {
      const std::size_t below = place / std::size_t(fine), above = std::min(below + 1, bins.size() - 1);
      const double t = double(place % std::size_t(fine)) / fine;
      each_.push_back(bins[below] + t * (bins[above] - bins[below]));
      before_.push_back(place == 0 ? 0 : before_.back() + (each_[place - 1] + each_[place]) / 2);
    }
  }

  std::size_t PlaceOf(float stored) const { return std::size_t(std::clamp(stored * scale_ + offset_, 0.0F, last_)); }
  double At(std::size_t place) const { return each_[place]; }
  // from <= to
  double MeanBetween(std::size_t from, std::size_t to) const {
    if (from == to) return each_[from];
    const double integral = before_[to] - before_[from];
    return integral > 0 ? integral / double(to - from) : 0;
  }

 private:
  float scale_ = 1, offset_ = 0, last_ = 0;
  std::vector<double> each_, before_;  // by place: extinction, and its integral from the first place to this one
};

// The extinction by the regions of a transfer function, of values between two others at one slope.
class RegionExtinction {
 public:
  RegionExtinction(const FrameSetup& setup, const ClassificationTable& classification, double per_voxel_length)
      : table_(MakeRegionTable(setup.transfer, classification, setup.description.mapping)) {
    table_.ReplaceOpacities(
        [&](double opacity) { return ExtinctionOfOpacity(opacity, classification.opacity_distance) * per_voxel_length; });
  }

  // Simpson's rule from low over value to high.
  double Mean(float low, float value, float high, float slope) const {
    return (double(At(low, slope)) + 4 * double(At(value, slope)) + double(At(high, slope))) / 6;
  }

 private:
  float At(float stored, float slope) const { return table_.At(stored, slope)[3]; }

  RegionTable table_;
};

struct SurfaceExtinction {
  float value = 0;  // stored sample
  double each = 0;  // of a voxel that it passes through
};

// What clipping leaves of voxels of the light volume.
class KeptShare {
 public:
  KeptShare(const FrameSetup& setup, const GridMap& from_light) : clip_(setup.clip), from_light_(from_light) {
    half_ = Least(setup.light->description.geometry.spacing) / 2;
  }

  // [0, 1], linear across a cut.
  double Of(const Index3& voxel) const {
    Vec3 p;
    for (const Axis axis : kAxes) p[axis] = from_light_.To(voxel[axis], axis);
    double least = std::numeric_limits<double>::max();
    for (const HalfSpace& side : clip_.sides) least = std::min(least, side.Distance(p));
    const double inside = std::clamp(0.5 + least / (2 * half_), 0.0, 1.0);
    return clip_.mode == ClipMode::kKeep ? inside : 1 - inside;
  }

 private:
  const ClipRegion& clip_;
  GridMap from_light_;
  double half_ = 0;  // a voxel
};

}  // namespace

Extinction ExtinctionOf(const VoxelBlock& values, const FrameSetup& setup) {
  const VolumeGeometry& light = setup.light->description.geometry;
  const VolumeGeometry& frame = setup.description.geometry;
  const Index3& size = light.size;
  const ClassificationTable table = setup.renderer->Table(setup.transfer, setup.description, setup.range);
  const ValueExtinction of_values(table, 1 / Least(frame.spacing));
  std::optional<RegionExtinction> of_regions;
  if (!setup.transfer.regions.empty()) of_regions.emplace(setup, table, 1 / Least(frame.spacing));
  std::vector<SurfaceExtinction> surfaces;
  const double voxel = std::cbrt(light.spacing.x * light.spacing.y * light.spacing.z);
  for (const Isosurface& surface : setup.transfer.isosurfaces) {
    const float value = StoredIsovalue(surface.value, setup.description.mapping);
    if (std::isfinite(value)) surfaces.push_back({value, -std::log1p(-std::min(surface.opacity, kMostOpacity)) / voxel});
  }
  // The square of a slope: squares of differences of two voxels' values, times these.
  const auto squared = [](double spacing) { return 0.25 / (spacing * spacing); };
  const double per_x = squared(light.spacing.x), per_y = squared(light.spacing.y), per_z = squared(light.spacing.z);
  const KeptShare kept(setup, MapBetween(light, frame));

  Extinction extinction{.size = size, .spacing = light.spacing, .each = std::vector<float>(CountIn(size))};
  VisitScalarType(values.type, [&]<class T>(const T*) {
    const T* const samples = values.samples<T>();
    tbb::parallel_for(std::int32_t{0}, size.z, [&](std::int32_t z) {
      const std::ptrdiff_t row = size.x, slice = row * size.y;
      for (std::int32_t y = 0; y < size.y; ++y) {
        const T* v = samples + z * slice + y * row;
        float* out = extinction.each.data() + z * slice + y * row;
        for (std::int32_t x = 0; x < size.x; ++x, ++v, ++out) {
          const auto value = float(*v);
          if (!std::isfinite(value)) continue;
          float least = value, greatest = value;
          const auto meet = [&](bool there, std::ptrdiff_t step) {
            const float near = there ? float(v[step]) : value;
            if (near < least) least = near;
            if (near > greatest) greatest = near;
            return near;
          };
          const float along_x = -meet(x > 0, -1) + meet(x + 1 < size.x, 1);
          const float along_y = -meet(y > 0, -row) + meet(y + 1 < size.y, row);
          const float along_z = -meet(z > 0, -slice) + meet(z + 1 < size.z, slice);
          const std::size_t place = of_values.PlaceOf(value);
          const float low = (value + least) / 2, high = (value + greatest) / 2;
          double sum = 0;
          if (of_regions) {
            const auto square = [](float difference) { return double(difference) * double(difference); };
            const auto slope = float(std::sqrt(square(along_x) * per_x + square(along_y) * per_y + square(along_z) * per_z));
            if (std::isfinite(slope)) sum = of_regions->Mean(low, value, high, slope);
          } else if (least == greatest) {
            sum = of_values.At(place);
          } else {
            sum = (of_values.MeanBetween(of_values.PlaceOf(low), place) + of_values.MeanBetween(place, of_values.PlaceOf(high))) / 2;
          }
          for (const SurfaceExtinction& surface : surfaces) {
            if (low < surface.value && surface.value <= high) sum += surface.each;
          }
          *out = float(sum);
          if (*out > 0 && !setup.clip.empty()) *out *= float(kept.Of({x, y, z}));
        }
      }
    });
  });
  return extinction;
}

}  // namespace slabstream
