#include "common/view/shading.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "common/base/range_status.h"

namespace slabstream {

Status Validate(const Shading& shading) {
  if (shading.lights.size() > std::size_t{kMaxLights}) {
    return Status::InvalidArgument(
        fmt::format("shading.lights has {} lights, but at most {} are allowed", shading.lights.size(), kMaxLights));
  }
  for (std::size_t i = 0; i < shading.lights.size(); ++i) {
    // The squared length must be usable too: it normalises the direction.
    const Vec3& light = shading.lights[i];
    const double length_squared = Dot(light, light);
    if (!std::isnormal(length_squared)) {
      return Status::InvalidArgument(
          fmt::format("shading.lights[{}] is {},{},{}, but must be a finite direction other than 0,0,0", i, light.x, light.y, light.z));
    }
  }
  const std::pair<const char*, float> weights[] = {
      {"shading.ambient", shading.ambient}, {"shading.diffuse", shading.diffuse}, {"shading.specular", shading.specular}};
  for (const auto& [field, value] : weights) {
    if (Status status = InRange(field, double(value), 0, 1); !status.ok()) return status;
  }
  return InRange("shading.shininess", double(shading.shininess), 1, 1000);
}

}  // namespace slabstream
