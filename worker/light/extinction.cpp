#include "worker/light/extinction.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/light/extinction.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "common/classification/region_table.h"
#include "common/memory/aligned_buffer.h"
#include "common/parallel/parallel.h"
#include "common/renderers/renderer_kind.h"
#include "common/volume/affine_map.h"
#include "common/volume/indices.h"

#ifndef SLABSTREAM_WORKER_LIGHT_EXTINCTION_CPP_  // shared by all instruction sets
#define SLABSTREAM_WORKER_LIGHT_EXTINCTION_CPP_
namespace slabstream {

inline constexpr std::int32_t kRowMargin = 16;  // floats before and behind a row: its neighbours, and what whole registers touch

// A row of samples and its neighbours along y and z; where there is none, the row itself. Its neighbours along x are its own samples,
// and the first and the last one repeat beyond the ends.
struct SampleRow {
  const float* at = nullptr;
  std::array<const float*, 4> beside{};  // before and behind along y, before and behind along z
};

// The extinction of stored samples, by place: between two bins of the classification table it is linear, and there are several places from
// bin to bin.
struct ExtinctionTable {
  float origin = 0, scale = 1, last = 0;  // the place of a sample s: clamp((s - origin) * scale + 0.5, 0, last), cut to a whole number
  std::int32_t first = 0;                 // nothing before this place takes any light
  std::vector<double> each, before;       // extinction, and its integral from the first place to this one
};

}  // namespace slabstream
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// The mean extinction around each of `count` samples: of values from it halfway to its least neighbour, and halfway to its greatest one.
// 0 where a sample is not finite. `out` has room for kRowMargin more.
void ExtinctionOfRow(const ExtinctionTable& table, const SampleRow& row, std::int32_t count, float* out) {
  const hn::CappedTag<double, 8> dd;
  const hn::RebindToSigned<decltype(dd)> dl;
  const hn::Rebind<float, decltype(dd)> df;
  const hn::Rebind<std::int32_t, decltype(dd)> di;
  const auto place_of = [&](auto sample) HWY_ATTR {
    const auto place = hn::MulAdd(hn::Sub(sample, hn::Set(df, table.origin)), hn::Set(df, table.scale), hn::Set(df, 0.5F));
    return hn::ConvertTo(di, hn::Min(hn::Max(place, hn::Zero(df)), hn::Set(df, table.last)));
  };
  for (std::int32_t x = 0; x < count; x += std::int32_t(hn::Lanes(dd))) {
    auto value = hn::LoadU(df, row.at + x);
    const auto finite = hn::Le(hn::Abs(value), hn::Set(df, std::numeric_limits<float>::max()));
    value = hn::IfThenElseZero(finite, value);
    auto least = value, greatest = value;
    for (const float* const neighbour :
         {row.at + x - 1, row.at + x + 1, row.beside[0] + x, row.beside[1] + x, row.beside[2] + x, row.beside[3] + x}) {
      const auto near = hn::LoadU(df, neighbour);
      least = hn::IfThenElse(hn::Lt(near, least), near, least);  // not if `near` is NaN
      greatest = hn::IfThenElse(hn::Gt(near, greatest), near, greatest);
    }
    const auto half = hn::Set(df, 0.5F);
    const auto high = place_of(hn::Mul(hn::Add(value, greatest), half));
    if (hn::AllTrue(di, hn::Lt(high, hn::Set(di, table.first)))) {  // air, most of many volumes
      hn::StoreU(hn::Zero(df), df, out + x);
      continue;
    }
    const auto low = place_of(hn::Mul(hn::Add(value, least), half)), middle = place_of(value);
    const auto gathered = [&](const std::vector<double>& from, auto place)
                              HWY_ATTR { return hn::GatherIndex(dd, from.data(), hn::PromoteTo(dl, place)); };
    const auto at_middle = gathered(table.each, middle), before_middle = gathered(table.before, middle);
    const auto mean = [&](auto integral, auto places) HWY_ATTR {
      const auto length = hn::PromoteTo(dd, places);
      return hn::IfThenElse(hn::Eq(length, hn::Zero(dd)), at_middle,
                            hn::Div(hn::Max(integral, hn::Zero(dd)), hn::Max(length, hn::Set(dd, 1))));
    };
    const auto below = mean(hn::Sub(before_middle, gathered(table.before, low)), hn::Sub(middle, low));
    const auto above = mean(hn::Sub(gathered(table.before, high), before_middle), hn::Sub(high, middle));
    const auto sum = hn::DemoteTo(df, hn::Mul(hn::Add(below, above), hn::Set(dd, 0.5)));
    hn::StoreU(hn::IfThenElseZero(finite, sum), df, out + x);
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
namespace {

HWY_EXPORT(ExtinctionOfRow);

double ExtinctionOfOpacity(double opacity, double opacity_distance) {
  const double of_length = -std::log1p(-std::min(opacity, 1 - 1e-12)) / opacity_distance;
  return std::min(of_length, -std::log1p(-kMostOpacity));
}

// The extinction of a voxel length times `per_voxel_length`.
ExtinctionTable MakeExtinctionTable(const ClassificationTable& table, double per_voxel_length) {
  constexpr int kPlaces = 8192;
  const int fine = std::max(2, kPlaces / table.size());  // even: halfway between two stored integers lies a place
  std::vector<double> bins;
  for (const float opacity : table.opacity) {
    bins.push_back(ExtinctionOfOpacity(double(opacity), table.opacity_distance) * per_voxel_length);
  }
  const auto last = (bins.size() - 1) * std::size_t(fine);
  ExtinctionTable made{.origin = float(table.stored_origin),
                       .scale = float(table.bin_from_stored_scale * fine),
                       .last = float(last),
                       .each = {},
                       .before = {}};
  for (std::size_t place = 0; place <= last; ++place) {
    const std::size_t below = place / std::size_t(fine), above = std::min(below + 1, bins.size() - 1);
    const double t = double(place % std::size_t(fine)) / fine;
    made.each.push_back(bins[below] + t * (bins[above] - bins[below]));
    made.before.push_back(place == 0 ? 0 : made.before.back() + (made.each[place - 1] + made.each[place]) / 2);
  }
  made.first = std::int32_t(std::ranges::find_if(made.each, [](double each) { return each > 0; }) - made.each.begin());
  return made;
}

// The extinction by the regions of a transfer function, of values between two others at one slope.
class RegionExtinction {
 public:
  RegionExtinction(const TransferFunction& transfer, const ValueMapping& mapping, const ClassificationTable& classification,
                   double per_voxel_length)
      : table_(MakeRegionTable(transfer, classification, mapping)) {
    table_.ReplaceOpacities(
        [&](double opacity) { return ExtinctionOfOpacity(opacity, classification.opacity_distance) * per_voxel_length; });
  }

  // Simpson's rule from low over value to high.
  float Mean(float low, float value, float high, float slope) const {
    return float((double(At(low, slope)) + 4 * double(At(value, slope)) + double(At(high, slope))) / 6);
  }

 private:
  float At(float stored, float slope) const { return table_.At(stored, slope)[3]; }

  RegionTable table_;
};

// A sample of a row, and halfway from it to the least and to the greatest of its neighbours.
struct NearbyValues {
  NearbyValues(const SampleRow& row, std::int32_t x) : value(row.at[x]), low(value), high(value) {
    for (const float near : {row.at[x - 1], row.at[x + 1], row.beside[0][x], row.beside[1][x], row.beside[2][x], row.beside[3][x]}) {
      if (near < low) low = near;
      if (near > high) high = near;
    }
    low = (value + low) / 2;
    high = (value + high) / 2;
  }
  float value, low, high;
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

// The extinction of one field on the grid of its light volume, which `values` is.
Extinction ExtinctionOfField(const VoxelBlock& values, const VolumeDescription& description, const FieldLook& look,
                             const RendererKind& renderer, double voxel_length) {
  const VolumeGeometry& light = description.geometry;
  const Index3& size = light.size;
  ClassificationTable table = renderer.Table(look.transfer, description, look.range);
  table.opacity_distance /= look.weight;  // weight w: the opacity is 1 - (1 - a)^w
  const ExtinctionTable of_values = MakeExtinctionTable(table, 1 / voxel_length);
  std::optional<RegionExtinction> of_regions;
  if (!look.transfer.regions.empty()) of_regions.emplace(look.transfer, description.mapping, table, 1 / voxel_length);
  std::vector<SurfaceExtinction> surfaces;
  const double voxel = std::cbrt(light.spacing.x * light.spacing.y * light.spacing.z);
  for (const Isosurface& surface : look.transfer.isosurfaces) {
    const float value = StoredIsovalue(surface.value, description.mapping);
    if (std::isfinite(value)) surfaces.push_back({value, -std::log1p(-std::min(surface.opacity, kMostOpacity)) / voxel});
  }
  // The square of a slope: squares of differences of two voxels' values, times these.
  const auto squared = [](double spacing) { return 0.25 / (spacing * spacing); };
  const Vec3 per_square = {squared(light.spacing.x), squared(light.spacing.y), squared(light.spacing.z)};
  const auto slope_at = [&](const SampleRow& row, std::int32_t x) {
    const auto square = [](float before, float behind) { return double(behind - before) * double(behind - before); };
    return float(std::sqrt(square(row.at[x - 1], row.at[x + 1]) * per_square.x + square(row.beside[0][x], row.beside[1][x]) * per_square.y +
                           square(row.beside[2][x], row.beside[3][x]) * per_square.z));
  };

  constexpr std::int64_t kSlicesAtOnce = 8;  // few, so that threads share them; each task reads two more
  Extinction extinction{.size = size, .spacing = light.spacing, .each = UnwrittenVector<float>(CountIn(size))};
  VisitScalarType(values.type, [&]<class T>(const T*) {
    const T* const samples = values.samples<T>();
    ParallelForRanges(0, size.z, kSlicesAtOnce, [&](std::int32_t z_begin, std::int32_t z_end) {
      // Of each of three neighbouring slices the rows as floats, with their margins.
      const std::ptrdiff_t row_room = size.x + 2 * kRowMargin;
      const auto row_floats = std::size_t(row_room);
      std::vector<float> room(3 * std::size_t(size.y) * row_floats), found(row_floats);
      const auto row_of = [&](std::int32_t y, std::int32_t z) {
        y = std::clamp(y, 0, size.y - 1);
        z = std::clamp(z, 0, size.z - 1);
        return room.data() + (z % 3 * size.y + y) * row_room + kRowMargin;
      };
      const auto load = [&](std::int32_t z) {
        for (std::int32_t y = 0; y < size.y; ++y) {
          float* const row = row_of(y, z);
          std::copy_n(samples + NumberIn(size, {0, y, z}), size.x, row);
          row[-1] = row[0];
          row[size.x] = row[size.x - 1];
        }
      };
      for (std::int32_t z = std::max(z_begin - 1, 0); z <= z_begin; ++z) load(z);
      for (std::int32_t z = z_begin; z < z_end; ++z) {
        if (z + 1 < size.z) load(z + 1);
        for (std::int32_t y = 0; y < size.y; ++y) {
          const SampleRow row = {row_of(y, z), {row_of(y - 1, z), row_of(y + 1, z), row_of(y, z - 1), row_of(y, z + 1)}};
          if (of_regions) {
            std::ranges::fill(found, 0.0F);
          } else {
            HWY_DYNAMIC_DISPATCH(ExtinctionOfRow)(of_values, row, size.x, found.data());
          }
          for (std::int32_t x = 0; x < size.x && (of_regions || !surfaces.empty()); ++x) {
            if (!std::isfinite(row.at[x])) continue;
            const NearbyValues near(row, x);
            float& sum = found[std::size_t(x)];
            if (of_regions) {
              const float slope = slope_at(row, x);
              if (std::isfinite(slope)) sum = of_regions->Mean(near.low, near.value, near.high, slope);
            }
            for (const SurfaceExtinction& surface : surfaces) {
              if (near.low < surface.value && surface.value <= near.high) sum += float(surface.each);
            }
          }
          std::copy_n(found.data(), size.x, extinction.each.data() + NumberIn(size, {0, y, z}));
        }
      }
    });
  });
  return extinction;
}

// Interpolated at p; 0 outside the grid.
double At(const Extinction& extinction, const Vec3& p) {
  const float* at = extinction.each.data();
  Vector3<std::ptrdiff_t> next;  // from a voxel to the one behind it, by axis
  Vec3 share;                    // of that one
  std::ptrdiff_t stride = 1;
  for (const Axis axis : kAxes) {
    const std::int32_t last = extinction.size[axis] - 1;
    if (!(p[axis] >= -0.5 && p[axis] < last + 0.5)) return 0;
    const double place = std::clamp(p[axis], 0.0, double(last));
    const auto below = std::int32_t(place);
    share[axis] = place - below;
    next[axis] = below < last ? stride : 0;
    at += below * stride;
    stride *= last + 1;
  }
  const auto mixed = [](double a, double b, double of_b) { return a + of_b * (b - a); };
  const auto along_x = [&](const float* row) { return mixed(double(row[0]), double(row[next.x]), share.x); };
  const auto in_plane = [&](const float* slice) { return mixed(along_x(slice), along_x(slice + next.y), share.y); };
  return mixed(in_plane(at), in_plane(at + next.z), share.z);
}

// Blends a field with those before it. `cover`: the field covers the share of them that it is opaque for such a length.
void AddBlended(const Extinction& own, const VolumeGeometry& own_grid, double cover, const VolumeGeometry& grid, Extinction& all) {
  const AffineMap map = AffineMapBetween(grid, own_grid);
  const bool same = map.is_identity() && own.size == all.size;
  constexpr double kMostPlaces = 8;  // along an axis of a voxel
  const Vec3 half = {0.5, 0.5, 0.5};
  Index3 places;  // as many as the voxel has voxels of the field
  for (const Axis axis : kAxes) {
    const double length = Length(map.steps.at(std::size_t(Number(axis))));
    places[axis] = std::int32_t(std::clamp(std::ceil(length - 1e-6), 1.0, kMostPlaces));
  }
  const auto mean_in = [&](const Index3& voxel) {
    double sum = 0;
    for (const Index3& place : IndicesIn(places)) sum += At(own, map.To(ToVec3(voxel) - half + (ToVec3(place) + half) / ToVec3(places)));
    return float(sum / double(CountIn(places)));
  };
  const Box touched = CoveringVoxels(own_grid.bounds(), AffineMapBetween(own_grid, grid), all.size, 0);
  ParallelFor(touched.begin.z, touched.end.z, [&](std::int32_t z) {
    for (const Index3& voxel : IndicesIn(Box{{touched.begin.x, touched.begin.y, z}, {touched.end.x, touched.end.y, z + 1}})) {
      const std::size_t number = NumberIn(all.size, voxel);
      const float added = same ? own.each[number] : mean_in(voxel);
      float& sum = all.each[number];
      if (cover > 0 && sum > 0 && added > 0) sum = float(double(sum) * std::exp(-cover * double(added)));
      sum += added;
    }
  });
}

}  // namespace

std::vector<FieldLook> LooksInLight(const FrameSetup& setup) {
  std::vector<FieldLook> looks = {{setup.transfer, setup.range, setup.weight}};
  for (const FieldSetup& field : setup.fields) {
    if (!field.labels) looks.push_back(field.look);
  }
  return looks;
}

Extinction ExtinctionOf(const LightValues& values, const FrameSetup& setup) {
  const std::vector<const CoarserLevel*> lights = LightVolumesOf(setup);
  const std::vector<FieldLook> looks = LooksInLight(setup);
  const VolumeGeometry& frame = setup.description.geometry;
  const VolumeGeometry& light = setup.light->description.geometry;
  const double voxel_length = Least(frame.spacing);
  Extinction all;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const VolumeDescription& description = lights[i]->description;
    Extinction own = ExtinctionOfField(values(i), description, looks[i], *setup.renderer, voxel_length);
    if (i == 0) {
      all = std::move(own);
      continue;
    }
    const double cover = looks[i].blend == Blend::kOver ? looks[i].transfer.opacity_distance * voxel_length : 0;
    AddBlended(own, description.geometry, cover, light, all);
  }
  if (setup.clip.empty()) return all;
  const KeptShare kept(setup, MapBetween(light, frame));
  ParallelFor(0, all.size.z, [&](std::int32_t z) {
    for (const Index3& voxel : IndicesIn(Box{{0, 0, z}, {all.size.x, all.size.y, z + 1}})) {
      float& sum = all.each[NumberIn(all.size, voxel)];
      if (sum > 0) sum *= float(kept.Of(voxel));
    }
  });
  return all;
}

}  // namespace slabstream
#endif
