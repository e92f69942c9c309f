#include "worker/rays/ray_look.h"

#include <algorithm>
#include <cmath>

#include "common/view/phong.h"

namespace slabstream {
namespace {

Float3 Divided(const Vec3& direction, const Vec3& spacing, double unit) {
  const Vec3 v = direction / (unit * spacing);
  return {float(v.x), float(v.y), float(v.z)};
}

void AddGradientOpacity(const TransferFunction& transfer, const VolumeDescription& description, double unit, RayLook& look) {
  const std::vector<GradientOpacityPoint>& points = transfer.gradient_opacities;
  if (points.empty() || !transfer.regions.empty()) return;  // a RegionTable has them, too
  const double steepest = points.back().slope;
  look.gradient_last = steepest > 0 ? kMaxBins - 1 : 0;
  const double per_slope = steepest > 0 ? double(look.gradient_last) / steepest : 0;  // entries
  for (int entry = 0; entry <= int(look.gradient_last); ++entry) {
    look.gradient_factors.push_back(float(GradientOpacity(points, steepest * entry / std::max(double(look.gradient_last), 1.0))));
  }
  // The kernel's gradients are differences over two voxels, of stored samples.
  look.gradient_scale = float(std::min(per_slope * std::abs(description.mapping.scale) * unit / 2, 1e30));
}

}  // namespace

RayLook MakeRayLook(const ClassificationTable& table, const TransferFunction& transfer, const VolumeDescription& description,
                    const Camera& camera, const Shading& shading, double steps_per_voxel, const Vec3& spacing) {
  RayLook look;
  const bool exact = description.type != ScalarType::kFloat32 && table.bin_from_stored_scale == 1;  // a bin for each stored value
  const int fine = exact ? kMaxBins / table.size() : 1;  // entries from one bin to the next: 16 for 8-bit volumes
  const int entries = (table.size() - 1) * fine + 1;
  look.origin = float(table.stored_origin);
  look.scale = float(table.bin_from_stored_scale * fine);
  look.rounding = exact ? 0.5F : 0.5F - 0x1p-9F;
  look.last = float(entries - 1);
  const double exponent = 1 / (steps_per_voxel * table.opacity_distance);  // 0: nothing shows
  // A power of two, so that it moves no bit of a light.
  const double unit = std::exp2(std::clamp(std::round(std::log2(table.stored_extent)), -126.0, 126.0));
  look.gradient_unit = float(unit);
  AddGradientOpacity(transfer, description, unit, look);
  look.step_exponent = float(exponent);
  look.entries.reserve(4 * std::size_t(entries));
  for (int entry = 0; entry < entries; ++entry) {
    const auto bin = std::size_t(entry / fine), next = std::min(bin + 1, std::size_t(table.size()) - 1);
    const float t = float(entry % fine) / float(fine);
    const Rgb &a = table.color[bin], &b = table.color[next];
    const double opacity = double(table.opacity[bin]) + double(t) * (double(table.opacity[next]) - double(table.opacity[bin]));
    const double of_step = look.gradient_factors.empty() ? -std::expm1(exponent * std::log1p(-opacity)) : opacity;
    const double of_entry = exponent > 0 ? of_step : 0;
    look.entries.insert(look.entries.end(), {a.r + t * (b.r - a.r), a.g + t * (b.g - a.g), a.b + t * (b.b - a.b), float(of_entry)});
    look.volume_shows = look.volume_shows || look.entries.back() > 0;
  }
  for (const Isosurface& surface : transfer.isosurfaces) {
    const float value = StoredIsovalue(surface.value, description.mapping);
    if (!(surface.opacity > 0) || !std::isfinite(value)) continue;
    look.isovalues.push_back(value);
    look.surface_looks.insert(look.surface_looks.end(), {surface.color.r, surface.color.g, surface.color.b, float(surface.opacity)});
  }

  const Phong phong(shading, camera.view_direction);
  const Vec3 to_viewer = -camera.view_direction;
  look.phong = shading.model == ShadingModel::kPhong;
  look.inverse_spacing = Divided({1, 1, 1}, spacing, unit);
  look.viewer = Divided(to_viewer, spacing, unit);
  for (const Vec3& light : phong.lights()) look.lights.push_back({Divided(light, spacing, unit), float(Dot(light, to_viewer))});
  const auto [ambient, diffuse, specular, shininess] = shading.On();
  look.ambient = ambient;
  look.diffuse = diffuse;
  look.specular = specular;
  look.shininess = shininess;
  const bool whole = shininess <= 128 && shininess == std::floor(shininess);
  look.whole_shininess = whole ? int(shininess) : 0;
  return look;
}

VisibleSamples::VisibleSamples(const RayLook& look)
    : origin_(look.origin), scale_(look.scale), rounding_(look.rounding), last_(look.last), visible_before_(1), isovalues_(look.isovalues) {
  for (std::size_t i = 3; i < look.entries.size(); i += 4)
    visible_before_.push_back(visible_before_.back() + (look.entries[i] > 0 ? 1 : 0));
}

bool VisibleSamples::AnyMatterBetween(float low, float high) const {
  if (!(low <= high)) return false;
  const auto entry = [&](float stored) { return std::size_t(std::clamp((stored - origin_) * scale_ + rounding_, 0.0F, last_)); };
  return visible_before_[entry(high) + 1] > visible_before_[entry(low)];
}

bool VisibleSamples::AnySurfaceBetween(float low, float high) const {
  return std::ranges::any_of(isovalues_, [&](float value) { return low < value && value <= high; });
}

}  // namespace slabstream
