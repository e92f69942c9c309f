// Phong (1975) shading with white directional lights and the viewer at infinity, on both sides of a surface:
//   I = clamp(colour * (ambient + diffuse * sum |N.L|) + specular * sum max(R.V, 0)^shininess, 0, 1);   R = 2 (N.L) N - L
// The sums run over the lights; V points against the view direction, L towards the light. Homogeneous material has no gradient: it is lit
// like the average of surfaces in all directions, |N.L| = 1/2, without a specular part. (If it were lit as if it faced the light, bright
// rings would show where footprints reach up from below the steps of a hard-edged surface.) A negative R.V counts as 0: edge-on to a
// headlight, R points straight away from the viewer, and |R.V| would make the rim as bright as the highlight.
#pragma once

#include <vector>

#include "common/math/vec.h"
#include "common/view/shading.h"

namespace slabstream {

// The factors that depend on the normal: I = clamp(colour * diffuse + specular).
struct PhongFactors {
  float diffuse = 1, specular = 0;
};

class Phong {
 public:
  // `view_direction`: physical, unit, away from the eye.
  Phong(const Shading& shading, const Vec3& view_direction);

  // The definition, in double precision, which tests compare kernels with.
  PhongFactors AtNormal(const Vec3& unit_normal) const;
  PhongFactors WithoutGradient() const;
  const std::vector<Vec3>& lights() const { return lights_; }  // unit directions towards them; the headlight if none was given

 private:
  ShadingModel model_;
  Material material_;
  std::vector<Vec3> lights_;  // unit
  Vec3 to_viewer_;            // unit
};

}  // namespace slabstream
