#include "common/view/phong.h"

#include <algorithm>
#include <cmath>

namespace slabstream {

Phong::Phong(const Shading& shading, const Vec3& view_direction)
    : model_(shading.model), material_(shading.On()), to_viewer_(-view_direction) {
  for (const Vec3& light : shading.lights) lights_.push_back(Normalized(light));
  if (lights_.empty()) lights_.push_back(to_viewer_);
}

PhongFactors Phong::AtNormal(const Vec3& unit_normal) const {
  if (model_ == ShadingModel::kNone) return {};
  double diffuse = 0, specular = 0;
  for (const Vec3& light : lights_) {
    const double n_l = Dot(unit_normal, light);
    const Vec3 reflected = 2 * n_l * unit_normal - light;
    diffuse += std::abs(n_l);
    specular += std::pow(std::clamp(Dot(reflected, to_viewer_), 0.0, 1.0), double(material_.shininess));
  }
  return {float(material_.ambient + material_.diffuse * diffuse), float(material_.specular * specular)};
}

PhongFactors Phong::WithoutGradient() const {
  if (model_ == ShadingModel::kNone) return {};
  constexpr double kMean = 0.5;  // of |N.L| over all directions of N
  return {float(material_.ambient + material_.diffuse * kMean * double(lights_.size())), 0.0F};
}

}  // namespace slabstream
