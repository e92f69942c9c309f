// How surfaces are lit: by Phong (1975) with white lights at infinity, or not at all.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"
#include "common/view/material.h"

namespace slabstream {

inline constexpr int kMaxLights = 8;

enum class ShadingModel : std::uint8_t {
  kPhong = 0,          // normals from the voxels
  kNone = 1,           // the colours of the transfer function
  kDepthGradient = 2,  // Phong with normals from the depths of the finished frame; renderers with depths only
};
inline constexpr std::array<std::string_view, 3> kShadingModelNames = {"phong", "none", "depth-gradient"};  // by ShadingModel
constexpr std::string_view NameOf(ShadingModel model) { return kShadingModelNames.at(std::size_t(model)); }

struct Shading {
  ShadingModel model = ShadingModel::kPhong;
  std::vector<Vec3> lights;  // directions towards the lights, not zero; of a request in the world, of a FrameSetup along the voxels' axes;
                             // empty: a headlight
  // As of a Material, and with the same limits.
  float ambient = Material().ambient, diffuse = Material().diffuse, specular = Material().specular, shininess = Material().shininess;
  // From the light volume (worker/light): how strong shadows are, and ambient occlusion by matter nearer than a radius. 0: none.
  float shadows = 0, ambient_occlusion = 0;  // [0, 1]
  float occlusion_radius = 0.1F;             // [0.01, 1], of the longest side of the volume
  bool needs_light_volume() const { return shadows > 0 || ambient_occlusion > 0; }
  friend bool operator==(const Shading&, const Shading&) = default;
};

// The shading of a request, on a transfer function's material. A number that the request changed from the standard one stays.
inline Shading OnMaterial(Shading shading, const Material& material) {
  constexpr Material kStandard;
  const auto take = [](float& number, float standard, float of_material) { number = number == standard ? of_material : number; };
  take(shading.ambient, kStandard.ambient, material.ambient);
  take(shading.diffuse, kStandard.diffuse, material.diffuse);
  take(shading.specular, kStandard.specular, material.specular);
  take(shading.shininess, kStandard.shininess, material.shininess);
  return shading;
}

}  // namespace slabstream
