#include "worker/renderers/raycast/ray_look.h"

#include <algorithm>
#include <cmath>

#include "common/view/phong.h"

namespace slabstream {
namespace {

Float3 Divided(const Vec3& direction, const Vec3& spacing) {
  const Vec3 v = direction / spacing;
  return {float(v.x), float(v.y), float(v.z)};
}

}  // namespace

RayLook MakeRayLook(const ClassificationTable& table, const VolumeDescription& description, const Camera& camera, const Shading& shading,
                    double steps_per_voxel) {
  RayLook look;
  const bool exact = description.type != ScalarType::kFloat32 && table.bin_from_stored_scale == 1;  // a bin for each stored value
  const int fine = exact ? kMaxBins / table.size() : 1;  // entries from one bin to the next: 16 for 8-bit volumes
  const int entries = (table.size() - 1) * fine + 1;
  look.origin = float(table.stored_origin);
  look.scale = float(table.bin_from_stored_scale * fine);
  look.rounding = exact ? 0.5F : 0.5F - 0x1p-9F;
  look.last = float(entries - 1);
  const double exponent = 1 / (steps_per_voxel * table.opacity_distance);
  look.entries.reserve(4 * std::size_t(entries));
  for (int entry = 0; entry < entries; ++entry) {
    const auto bin = std::size_t(entry / fine), next = std::min(bin + 1, std::size_t(table.size()) - 1);
    const float t = float(entry % fine) / float(fine);
    const Rgb &a = table.color[bin], &b = table.color[next];
    const double opacity = double(table.opacity[bin]) + double(t) * (double(table.opacity[next]) - double(table.opacity[bin]));
    look.entries.insert(look.entries.end(), {a.r + t * (b.r - a.r), a.g + t * (b.g - a.g), a.b + t * (b.b - a.b),
                                             float(-std::expm1(exponent * std::log1p(-opacity)))});
  }

  const Phong phong(shading, camera.view_direction);
  const Vec3 to_viewer = -camera.view_direction;
  look.phong = shading.model == ShadingModel::kPhong;
  look.inverse_spacing = Divided({1, 1, 1}, camera.spacing);
  look.viewer = Divided(to_viewer, camera.spacing);
  for (const Vec3& light : phong.lights()) look.lights.push_back({Divided(light, camera.spacing), float(Dot(light, to_viewer))});
  look.ambient = shading.ambient;
  look.diffuse = shading.diffuse;
  look.specular = shading.specular;
  look.shininess = shading.shininess;
  look.diffuse_without_gradient = phong.WithoutGradient().diffuse;
  return look;
}

VisibleSamples::VisibleSamples(const RayLook& look)
    : origin_(look.origin), scale_(look.scale), rounding_(look.rounding), last_(look.last), visible_before_(1) {
  for (std::size_t i = 3; i < look.entries.size(); i += 4)
    visible_before_.push_back(visible_before_.back() + (look.entries[i] > 0 ? 1 : 0));
}

bool VisibleSamples::AnyBetween(float low, float high) const {
  if (!(low <= high)) return false;
  const auto entry = [&](float stored) { return std::size_t(std::clamp((stored - origin_) * scale_ + rounding_, 0.0F, last_)); };
  return visible_before_[entry(high) + 1] > visible_before_[entry(low)];
}

}  // namespace slabstream
